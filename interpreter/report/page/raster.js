// Triangles into pixels: depth, shade and colour in plain arrays, so that no graphics card is needed.
const SHADES = 32, COLOURS = 256;

// Colours of [red, green, blue] (0..255) for every value and shade, as the pixels of a canvas have them.
function palette(colour) {
  const table = new Uint32Array(COLOURS * SHADES);
  for (let v = 0; v < COLOURS; v++) {
    const [r, g, b] = colour(v / (COLOURS - 1));
    for (let s = 0; s < SHADES; s++) {
      const l = 0.56 + 0.5 * s / (SHADES - 1), part = (x) => Math.max(0, Math.min(255, Math.round(x * l)));
      table[v * SHADES + s] = (255 << 24) | (part(b) << 16) | (part(g) << 8) | part(r);
    }
  }
  return table;
}

// Viridis as a polynomial of the sixth degree: perceptually uniform, safe for colour-blind readers.
const VIRIDIS = [
  [0.2777, 0.0054, 0.3341], [0.1051, 1.4046, 1.3846], [-0.3309, 0.2148, 0.0951], [-4.6342, -5.7991, -19.3324],
  [6.2283, 14.1799, 56.6906], [4.7764, -13.7451, -65.3530], [-5.4355, 4.6459, 26.3124],
];
const viridis = (t) => [0, 1, 2].map((c) =>
  255 * Math.max(0, Math.min(1, VIRIDIS.reduceRight((sum, row) => sum * t + row[c], 0))));

// A picture that surfaces are painted into: `owner` says whose each pixel is, `facet` which triangle it shows.
function frame(width, height) {
  const image = new ImageData(width, height);
  return {
    width, height, image, pixels: new Uint32Array(image.data.buffer), depth: new Float32Array(width * height),
    owner: new Uint8Array(width * height), facet: new Int32Array(width * height),
  };
}

function wipe(into) {
  into.pixels.fill(0);
  into.depth.fill(-Infinity);
  into.owner.fill(0);
}

// `at`: x, y, depth of points in pixels; `light` 0..1 for each corner; `value` 0..1 for each point or null.
function paint(into, at, triangles, light, value, table, owner) {
  const { width, height, pixels, depth } = into;
  for (let t = 0; t < triangles.length; t += 3) {
    const a = triangles[t], b = triangles[t + 1], c = triangles[t + 2];
    const ax = at[3 * a], ay = at[3 * a + 1], bx = at[3 * b], by = at[3 * b + 1], cx = at[3 * c], cy = at[3 * c + 1];
    const area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax);
    if (area === 0) continue;
    const left = Math.max(0, Math.ceil(Math.min(ax, bx, cx) - 0.5)), right = Math.min(width - 1, Math.floor(Math.max(ax, bx, cx) - 0.5));
    const top = Math.max(0, Math.ceil(Math.min(ay, by, cy) - 0.5)), bottom = Math.min(height - 1, Math.floor(Math.max(ay, by, cy) - 0.5));
    const dxa = (by - cy) / area, dxb = (cy - ay) / area;
    const za = at[3 * a + 2], zb = at[3 * b + 2], zc = at[3 * c + 2];
    const la = light[t], lb = light[t + 1], lc = light[t + 2];
    const va = value ? value[a] : 0, vb = value ? value[b] : 0, vc = value ? value[c] : 0;
    for (let y = top; y <= bottom; y++) {
      const px = left + 0.5, py = y + 0.5;
      let wa = ((bx - px) * (cy - py) - (by - py) * (cx - px)) / area;
      let wb = ((cx - px) * (ay - py) - (cy - py) * (ax - px)) / area;
      for (let x = left, i = y * width + left; x <= right; x++, i++, wa += dxa, wb += dxb) {
        const wc = 1 - wa - wb;
        if (wa < -1e-6 || wb < -1e-6 || wc < -1e-6) continue;
        const z = wa * za + wb * zb + wc * zc;
        if (z <= depth[i]) continue;
        depth[i] = z;
        into.owner[i] = owner;
        into.facet[i] = t;
        const v = Math.max(0, Math.min(COLOURS - 1, ((wa * va + wb * vb + wc * vc) * (COLOURS - 1) + 0.5) | 0));
        const s = Math.max(0, Math.min(SHADES - 1, ((wa * la + wb * lb + wc * lc) * (SHADES - 1) + 0.5) | 0));
        pixels[i] = table[v * SHADES + s];
      }
    }
  }
}

// A line where one owner ends and another begins.
function outline(into, owner, ink) {
  const { width, height, pixels } = into, edge = [];
  for (let y = 1; y < height - 1; y++)
    for (let x = 1, i = y * width + 1; x < width - 1; x++, i++)
      if (owner[i] && (owner[i - 1] !== owner[i] || owner[i + 1] !== owner[i] || owner[i - width] !== owner[i] || owner[i + width] !== owner[i]))
        edge.push(i);
  for (const i of edge) pixels[i] = ink;
  return edge.length;
}

// Light on each corner: the point's normal, or the facet's own where the surface has an edge. Light comes
// from over the reader's left shoulder; both sides of a surface are lit.
function lit(at, triangles, light) {
  const n = triangles.length / 3, facets = new Float32Array(3 * n), points = new Float32Array(at.length);
  for (let f = 0; f < n; f++) {
    const [a, b, c] = [3 * triangles[3 * f], 3 * triangles[3 * f + 1], 3 * triangles[3 * f + 2]];
    const ux = at[b] - at[a], uy = at[b + 1] - at[a + 1], uz = at[b + 2] - at[a + 2];
    const vx = at[c] - at[a], vy = at[c + 1] - at[a + 1], vz = at[c + 2] - at[a + 2];
    const N = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    for (const p of [a, b, c]) for (let k = 0; k < 3; k++) points[p + k] += N[k];
    const length = Math.hypot(...N) || 1;
    for (let k = 0; k < 3; k++) facets[3 * f + k] = N[k] / length;
  }
  for (let p = 0; p < points.length; p += 3) {
    const length = Math.hypot(points[p], points[p + 1], points[p + 2]) || 1;
    for (let k = 0; k < 3; k++) points[p + k] /= length;
  }
  for (let t = 0; t < 3 * n; t++) {
    const f = 3 * Math.floor(t / 3), p = 3 * triangles[t];
    const same = facets[f] * points[p] + facets[f + 1] * points[p + 1] + facets[f + 2] * points[p + 2];
    const [N, k] = same > 0.75 ? [points, p] : [facets, f];
    light[t] = Math.abs(-0.32 * N[k] - 0.5 * N[k + 1] + 0.8 * N[k + 2]);
  }
}
