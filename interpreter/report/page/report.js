"use strict";
// Coordinates of points, by pointer and by arrow keys; the numbers are those of the figure's own table.
document.querySelectorAll("figure.plate").forEach((plate) => {
  const box = plate.querySelector(".drawing"), svg = box.querySelector("svg"), table = plate.querySelector("table.data");
  const curves = [...svg.querySelectorAll("g.curve")].map((g) => {
    const skip = (g.dataset.skip || "").split(" ");
    const at = [...g.querySelectorAll("polyline")].flatMap((line) => [...line.points].map((p) => [p.x, p.y]));
    const rows = [...table.tBodies[0].rows].map((_, i) => i).filter((i) => !skip.includes(String(i)));
    return { g, at, rows: rows.slice(0, at.length), first: +g.dataset.c, width: +g.dataset.w };
  }).filter((curve) => curve.at.length);
  if (!curves.length) return;

  // the title would also be a tooltip of the browser's own
  const title = svg.querySelector("title"), words = title.textContent;
  title.remove();
  svg.removeAttribute("aria-labelledby");
  svg.setAttribute("aria-label", words);
  svg.setAttribute("aria-describedby", svg.querySelector("desc").id);

  const tip = document.createElement("div");
  tip.className = "tip";
  tip.hidden = true;
  const spoken = document.createElement("div");
  spoken.className = "spoken";
  spoken.setAttribute("aria-live", "polite");
  const ring = document.createElementNS(svg.namespaceURI, "circle");
  ring.setAttribute("class", "ring");
  ring.setAttribute("r", 7);
  box.append(tip, spoken);
  box.tabIndex = 0;
  box.setAttribute("role", "group");
  box.setAttribute("aria-label", "Points of the figure; arrow keys go from point to point and from curve to curve");

  let now = null;
  const shown = () => curves.filter((curve) => getComputedStyle(curve.g).display !== "none");
  const symbols = [...table.tHead.rows[1].cells].map((cell) => cell.textContent);
  const reading = (symbol, value) => {
    const [name, unit] = symbol.split(" / ");
    return name + "\u00a0" + value + (unit ? "\u00a0" + unit : "");
  };

  function show(curve, k, aloud) {
    hide();
    now = { curve, k };
    const [x, y] = curve.at[k], cells = table.tBodies[0].rows[curve.rows[k]].cells;
    const parts = [reading(table.tHead.rows[0].cells[0].dataset.q, cells[0].textContent)];
    for (let i = 0; i < curve.width; i++)
      parts.push(reading(symbols[curve.first - 1 + i], cells[curve.first + i].textContent));
    const name = document.createElement("b");
    name.textContent = curve.g.dataset.name;
    tip.replaceChildren(name, ...parts.map((part) => {
      const line = document.createElement("span");
      line.textContent = part;
      return line;
    }));
    if (aloud) spoken.textContent = curve.g.dataset.name + ": " + parts.join(", ");
    ring.setAttribute("cx", x);
    ring.setAttribute("cy", y);
    svg.append(ring);
    curve.g.classList.add("lit");
    tip.hidden = false;
    const frame = svg.getBoundingClientRect(), outer = box.getBoundingClientRect();
    const scale = frame.width / svg.viewBox.baseVal.width;
    const px = frame.left - outer.left + x * scale, py = frame.top - outer.top + y * scale;
    const left = px + 14 + tip.offsetWidth > outer.width ? px - 14 - tip.offsetWidth : px + 14;
    tip.style.left = Math.max(0, left) + "px";
    tip.style.top = Math.max(0, py - tip.offsetHeight - 10) + "px";
  }

  function hide() {
    if (now) now.curve.g.classList.remove("lit");
    now = null;
    tip.hidden = true;
    ring.remove();
  }

  function near(event) {
    const frame = svg.getBoundingClientRect(), scale = svg.viewBox.baseVal.width / frame.width;
    const x = (event.clientX - frame.left) * scale, y = (event.clientY - frame.top) * scale;
    let best = null, least = 28;
    for (const curve of shown().reverse())
      curve.at.forEach(([px, py], k) => {
        const d = Math.hypot(px - x, py - y);
        if (d < least - 0.5) { least = d; best = [curve, k]; }
      });
    if (best) show(...best, false); else hide();
  }

  svg.addEventListener("pointermove", near);
  svg.addEventListener("pointerdown", near);
  svg.addEventListener("pointerleave", hide);
  box.addEventListener("blur", hide);
  box.addEventListener("keydown", (event) => {
    const all = shown();
    if (event.key === "Escape") return hide();
    if (!/^(Arrow(Left|Right|Up|Down)|Home|End)$/.test(event.key) || !all.length) return;
    event.preventDefault();
    let c = now ? all.indexOf(now.curve) : -1, k = now ? now.k : 0;
    if (c < 0) [c, k] = [all.length - 1, 0];
    else if (event.key === "ArrowUp") c = (c + all.length - 1) % all.length;
    else if (event.key === "ArrowDown") c = (c + 1) % all.length;
    else k = { ArrowLeft: k - 1, ArrowRight: k + 1, Home: 0, End: Infinity }[event.key];
    show(all[c], Math.max(0, Math.min(all[c].at.length - 1, k)), true);
  });

  // a curve stands out while its line of the legend is pointed at or has the focus
  plate.querySelectorAll(".legend label").forEach((label) => {
    const g = svg.querySelector("g." + label.querySelector("input").value);
    for (const [event, on] of [["pointerenter", 1], ["focusin", 1], ["pointerleave", 0], ["focusout", 0]])
      label.addEventListener(event, () => g.classList.toggle("lit", !!on));
  });
});
