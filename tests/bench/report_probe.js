// What a page shows: the body of a function that runs in it (tests/bench/test_report_browser.py).
const size = box => box.getBoundingClientRect();
for (const one of document.querySelectorAll("details")) one.open = true;
const pick = document.querySelector(".pick select");
if (pick) {
  pick.selectedIndex = pick.length - 1;
  pick.dispatchEvent(new Event("change", { bubbles: true }));
  const last = [...document.querySelectorAll(".heat")].at(-1);
  for (let turn = 0; turn < 100 && last.hidden; turn++) await new Promise(next => setTimeout(next, 50));
}
const broken = [];
await Promise.all([...document.images].map(image => image.decode().catch(() => broken.push(image.alt))));
const boxes = [...document.querySelectorAll("figure img, figure svg, .forest svg, .stagebar, .solid")];
const shown = boxes.filter(box => !box.hidden);
const scrolls = box => ["auto", "scroll"].includes(getComputedStyle(box).overflowX);
const inside = box => box && (scrolls(box) || inside(box.parentElement));
const edge = document.documentElement.clientWidth + 0.5;
const out = [...document.querySelectorAll("main *:not(svg *)")].filter(box => size(box).right > edge);
const names = box => box.tagName + "." + box.className + " " + box.textContent.slice(0, 40);
const found = {
  width: innerWidth,
  figures: shown.length,
  empty: shown.filter(box => size(box).width < 8 || size(box).height < 8).map(names),
  out: out.filter(box => !inside(box)).map(names),
  overflow: document.documentElement.scrollWidth - document.documentElement.clientWidth,
  parts: Object.fromEntries([...document.querySelectorAll("#verdict, section")].map(one => [one.id,
    { height: size(one).height, words: one.innerText.length, pictures: one.querySelectorAll("svg, img").length }])),
  verdict: document.querySelector("#verdict").innerText,
  heats: [...document.querySelectorAll(".heat")].map(one => ({ hidden: one.hidden, words: one.innerText })),
  blank: [...document.querySelectorAll(".swatch")].filter(one => {
    const style = getComputedStyle(one);
    return style.backgroundColor === "rgba(0, 0, 0, 0)" && style.backgroundImage === "none" &&
      style.borderStyle === "none" && style.outlineStyle === "none";
  }).map(one => one.parentElement.textContent),
  commands: [...document.querySelectorAll(".case .command code")].map(one => one.textContent),
  cases: document.querySelectorAll(".case").length,
  loaded: performance.getEntriesByType("resource").map(one => one.name).filter(name => !name.startsWith("data:")),
  webgl: !!document.createElement("canvas").getContext("webgl"),
};
const solid = document.querySelector(".solid"), view = solid.view;
const pixels = () => {
  view.draw();
  const { width, height } = view.canvas, data = new Uint8Array(4 * width * height);
  view.gl.readPixels(0, 0, width, height, view.gl.RGBA, view.gl.UNSIGNED_BYTE, data);
  return data;
};
const turned = async () => {
  await view.start();
  const before = pixels();
  solid.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowLeft" }));
  const after = pixels();
  return { drawn: before.filter((v, k) => k % 4 === 3 && v > 0).length / (before.length / 4),
    changed: before.filter((v, k) => v !== after[k]).length };
};
found.turned = found.webgl ? await turned().catch(error => ({ error: String(error) })) : null;
return { ...found, errors: failures, broken };
