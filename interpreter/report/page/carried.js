// Stress, strain and stretch as colour: in pages of scenes that ask for them, and in no others.
function carry(app) {
  const { figure, solids, data, get } = app, which = get(".number select");
  data.carried = data.carried || []; // of a body that nobody asks about, beside one that somebody does
  const unpacked = (text) => new Uint16Array(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
  for (const solid of solids) {
    solid.numbers = (solid.carried || []).map((n) => n && n.values && {
      values: Float32Array.from(unpacked(n.values), (s) => n.low + s / 65535 * (n.high - n.low)), said: n.said,
      shares: new Float32Array(solid.points),
    });
    solid.label = solid.panel.querySelector("small");
    if (!solid.label) solid.panel.querySelector("p").append(solid.label = document.createElement("small"));
    solid.words = [solid.label.textContent, solid.canvas.getAttribute("aria-label")];
  }
  app.number = 0;
  // what stands below a shape, and what is read of it aloud, is about what its colours are
  function relabel() {
    const carried = app.chosen("colour") === "carried";
    for (const bar of figure.querySelectorAll(".colour-bar.carried")) bar.hidden = +bar.dataset.number !== app.number;
    for (const solid of solids) {
      const number = carried && solid.numbers[app.number];
      const said = number ? number.said : carried && solid.carried ? `no ${data.carried[app.number].words}` : "";
      solid.label.textContent = said || solid.words[0];
      solid.canvas.setAttribute("aria-label", said ? `${solid.name}: ${said}` : solid.words[1]);
    }
  }
  if (which) which.addEventListener("change", () => {
    app.number = +which.value.slice(1);
    get("input[value=carried]").click();
    relabel();
  });
  figure.querySelectorAll('input[name^="colour"]').forEach((input) => input.addEventListener("change", relabel));
  data.carried.forEach((c) => { c.text = (v) => +(v / c.factor).toPrecision(4) + (c.symbol && "\u00a0" + c.symbol); });
  relabel();
}

const numberOf = (app, solid) => app.chosen("colour") === "carried" ? solid.numbers[app.number] : null;

// Where each point lies on the one scale of all models, 0..1; nothing of a shape that has no such number, which is drawn
// grey, for its own colour could be read as one; null where colour is something else, or not known now.
function tinted(app, solid) {
  if (app.chosen("colour") !== "carried" || !solid.known) return null;
  const number = solid.numbers[app.number];
  if (!number) return [];
  const [low, high] = app.data.carried[app.number][app.chosen("span") === "whole" ? "whole" : "usual"];
  for (let i = 0; i < number.values.length; i++) number.shares[i] = (number.values[i] - low) / (high - low);
  return number.shares;
}

// Before the end nothing is known of stress, as of errors.
function unsure(app, shown) {
  if (shown.some((s) => !s.known && numberOf(app, s))) app.get(".unknown").hidden = false;
}

function told(app, solid, p) {
  const number = solid.known && numberOf(app, solid), kind = app.data.carried[app.number];
  return number ? [`${kind.words}: ${kind.text(number.values[p]).replace("-", "−")}`] : [];
}

const exact = (solid, i, p) => solid.known && solid.numbers[i] ? solid.numbers[i].values[p].toPrecision(5) : "";
