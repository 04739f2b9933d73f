// Rigid bodies, seen through: in pages of scenes that have some, and in no others.
const VEIL = 0.42; // how much of what is behind a rigid body it hides

function instrumented(data, solids, bytes) {
  const shorts = (text) => new Uint16Array(bytes(text));
  const known = (data.instruments || []).map((own) => ({
    ...own, rest: Float32Array.from(shorts(own.position), (s, i) => own.low[i % 3] + s / 65535 * own.span[i % 3]),
    triangles: own.wide ? new Uint32Array(bytes(own.triangles)) : shorts(own.triangles),
  }));
  for (const solid of solids)
    solid.beside = (solid.instruments || []).map((place) => {
      const own = known[place.of], n = own.rest.length;
      return { ...own, ...place, X: new Float32Array(n), at: new Float32Array(n), light: new Float32Array(own.triangles.length) };
    });
}

// Where they are at a time, on a straight line between two frames that are known, as the shape beside them.
function accompany(solid, time) {
  for (const { rest, X, turns, shifts } of solid.beside) {
    let k = turns.length - 1, w = 0;
    if (turns.length > 1 && time < solid.times[k]) {
      k = 0;
      while (k + 2 < turns.length && solid.times[k + 1] <= time) k++;
      w = Math.max(0, (time - solid.times[k]) / (solid.times[k + 1] - solid.times[k]));
    }
    const next = Math.min(k + 1, turns.length - 1), between = (a, b) => a.map((v, i) => (1 - w) * v + w * b[i]);
    const Q = between(turns[k], turns[next]), s = between(shifts[k], shifts[next]);
    for (let p = 0; p < X.length; p += 3)
      for (let i = 0; i < 3; i++) X[p + i] = Q[3 * i] * rest[p] + Q[3 * i + 1] * rest[p + 1] + Q[3 * i + 2] * rest[p + 2] + s[i];
  }
}

// Their points at all times, for the size of the picture; those out of its room count at its edge.
function reached(app, solid, take) {
  if (!solid.beside.length) return;
  const [low, high] = app.data.room, within = (v, i) => Math.max(low[i], Math.min(high[i], v));
  for (const time of solid.times || [0]) {
    accompany(solid, time);
    for (const { X } of solid.beside)
      for (let p = 0; p < X.length; p += 3) take(within(X[p], 0), within(X[p + 1], 1), within(X[p + 2], 2));
  }
}

// The nearest of their surfaces over what is painted, where nothing is before it.
function veil(canvas, shown, into, project, table, ink) {
  const { width, height, pixels } = into;
  if (!canvas.glass || canvas.glass.width !== width || canvas.glass.height !== height) canvas.glass = frame(width, height);
  const glass = canvas.glass;
  wipe(glass);
  shown.forEach((solid) => solid.beside.forEach((body) => {
    project(body, glass);
    paint(glass, body.at, body.triangles, body.light, null, table, 1 + solid.index);
  }));
  for (let i = 0; i < pixels.length; i++) {
    if (!glass.owner[i]) continue;
    if (glass.depth[i] <= into.depth[i]) glass.owner[i] = 0;
    else if (!into.owner[i] && !(pixels[i] >>> 24)) pixels[i] = (Math.round(255 * VEIL) << 24 | glass.pixels[i] & 0xffffff) >>> 0;
    else {
      const mix = (shift) => Math.round((1 - VEIL) * (pixels[i] >>> shift & 255) + VEIL * (glass.pixels[i] >>> shift & 255)) << shift;
      pixels[i] = (255 << 24 | mix(16) | mix(8) | mix(0)) >>> 0;
    }
  }
  return outline(into, glass.owner, ink);
}

// Which of them is at a pixel that shows no shape.
function instrumentAt(app, canvas, x, y) {
  const { owner, facet, width } = canvas.glass, i = y * width + x, solid = app.solids[owner[i] - 1];
  if (!solid) return null;
  const holds = ({ at, triangles }) => {
    if (facet[i] >= triangles.length) return false;
    const [a, b, c] = [0, 1, 2].map((k) => 3 * triangles[facet[i] + k]);
    const side = (p, q) => Math.sign((at[q] - at[p]) * (y + 0.5 - at[p + 1]) - (at[q + 1] - at[p + 1]) * (x + 0.5 - at[p]));
    return Math.abs(side(a, b) + side(b, c) + side(c, a)) >= 2;
  };
  return solid.beside.find(holds) || solid.beside[0];
}
