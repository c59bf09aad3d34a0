"use strict";
for (const pick of document.querySelectorAll(".pick select")) {
  const heats = [];
  for (let next = pick.closest(".pick").nextElementSibling; next && next.matches(".heat"); next = next.nextElementSibling) heats.push(next);
  pick.addEventListener("change", () => heats.forEach((heat, number) => { heat.hidden = number !== pick.selectedIndex; }));
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
