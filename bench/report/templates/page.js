"use strict";
const bytes = text => Uint8Array.from(atob(text), letter => letter.charCodeAt(0));
const inflated = data => new Response(new Blob([data]).stream().pipeThrough(new DecompressionStream("deflate")));

// long tables are unpacked when they are opened
for (const box of document.querySelectorAll("details[data-packed]")) {
  box.addEventListener("toggle", async () => {
    const { packed } = box.dataset;
    if (!packed || !box.open) return;
    delete box.dataset.packed;
    box.insertAdjacentHTML("beforeend", await inflated(bytes(packed)).text());
  });
}

// one heat map of many is shown; the others are unpacked when they are asked for
for (const pick of document.querySelectorAll(".pick")) {
  const heats = [], choices = [...pick.querySelectorAll("select")];
  for (let next = pick.nextElementSibling; next && next.matches(".heat"); next = next.nextElementSibling) heats.push(next);
  pick.addEventListener("change", async () => {
    const number = choices.reduce((sum, one) => sum * one.length + one.selectedIndex, 0), heat = heats[number];
    if (heat.dataset.packed) {
      heat.innerHTML = await inflated(bytes(heat.dataset.packed)).text();
      delete heat.dataset.packed;
    }
    heats.forEach(one => { one.hidden = one !== heat; });
  });
}
addEventListener("beforeprint", () => document.querySelectorAll(".unfold").forEach(one => { one.open = true; }));
for (const button of document.querySelectorAll(".copy")) {
  button.addEventListener("click", async () => {
    const code = button.parentElement.querySelector("code");
    try {
      await navigator.clipboard.writeText(code.textContent);
    } catch {
      getSelection().selectAllChildren(code);
      document.execCommand("copy");
    }
    button.textContent = "copied";
    setTimeout(() => { button.textContent = "copy"; }, 1500);
  });
}
