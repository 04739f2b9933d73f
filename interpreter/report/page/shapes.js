// The shapes of the page: one camera for all, error as colour, a slider where there is time.
document.querySelectorAll("figure.shapes").forEach((figure) => {
  const data = JSON.parse(figure.querySelector("script").textContent);
  const stage = figure.querySelector(".stage"), get = (selector) => figure.querySelector(selector);
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
  const shorts = (text) => new Uint16Array(bytes(text));
  const meshes = data.meshes.map((m) => m.wide ? new Uint32Array(bytes(m.triangles)) : new Uint16Array(bytes(m.triangles)));
  const errors = palette(viridis);

  // ---------------------------------------------------------------- shapes

  const solids = data.shapes.map((given, index) => {
    const panel = figure.querySelectorAll(".panel")[index], n = given.points;
    const step = [0, 1, 2].map((k) => (given.high[k] - given.low[k]) / 65535);
    const solid = {
      ...given, index, panel, canvas: panel.querySelector("canvas"), triangles: meshes[given.mesh],
      end: shorts(given.position), course: given.frames ? shorts(given.frames) : null,
      error: given.error ? Float32Array.from(shorts(given.error), (e) => e / 65535 * given.most) : null,
      at: new Float32Array(3 * n), X: new Float32Array(3 * n), light: new Float32Array(meshes[given.mesh].length),
      value: given.error ? new Float32Array(n) : null, shown: panel.dataset.shown !== "no",
    };
    solid.place = (packed, i) => given.low[i % 3] + packed * step[i % 3];
    return solid;
  });
  instrumented(data, solids, bytes); // with instruments.js
  const moving = solids.filter((s) => s.course), last = Math.max(0, ...moving.map((s) => s.times[s.times.length - 1]));

  // Positions at a time, on a straight line between two frames that are known.
  function pose(solid, time) {
    const { X, course, times, place } = solid, n = X.length;
    if (!course || time >= times[times.length - 1])
      for (let i = 0; i < n; i++) X[i] = place(solid.end[i], i);
    else {
      let k = 0;
      while (k + 2 < times.length && times[k + 1] <= time) k++;
      const w = times.length < 2 ? 0 : Math.max(0, (time - times[k]) / (times[k + 1] - times[k])), a = k * n, b = Math.min(k + 1, times.length - 1) * n;
      for (let i = 0; i < n; i++) X[i] = place((1 - w) * course[a + i] + w * course[b + i], i);
    }
    solid.known = !course || time >= times[times.length - 1];
    accompany(solid, time); // with instruments.js
  }

  // ---------------------------------------------------------------- what is chosen

  const camera = { yaw: 0, pitch: 0, zoom: 1 };
  const state = { time: last, playing: false, quick: false };
  const chosen = (name) => (get(`input[name^="${name}"]:checked`) || {}).value;
  const ghost = () => {
    const pick = get("select");
    return pick && pick.value ? solids[+pick.value] : null;
  };
  const overlaid = () => chosen("layout") === "overlaid";

  function basis() {
    const { yaw, pitch } = camera, s = Math.sin(yaw), c = Math.cos(yaw), u = Math.sin(pitch), v = Math.cos(pitch);
    const level = [[c, s, 0], [-s * u, c * u, v], [s * v, -c * v, u]]; // right, up, towards the reader
    return level.map((row) => [0, 1, 2].map((k) => row.reduce((sum, a, i) => sum + a * data.frame[i][k], 0)));
  }

  // What the picture is centred on and how large it is: all shapes at all times, kept while the camera turns.
  let fitted = null;
  function fit() {
    const axes = basis(), low = [Infinity, Infinity], high = [-Infinity, -Infinity];
    const take = (x, y, z) => {
      for (let k = 0; k < 2; k++) {
        const p = axes[k][0] * x + axes[k][1] * y + axes[k][2] * z;
        if (p < low[k]) low[k] = p;
        if (p > high[k]) high[k] = p;
      }
    };
    for (const solid of solids) {
      for (const packed of [solid.end, solid.course || []])
        for (let i = 0; i < packed.length; i += 3)
          take(solid.place(packed[i], 0), solid.place(packed[i + 1], 1), solid.place(packed[i + 2], 2));
      reached(app, solid, take); // with instruments.js
    }
    const [u, v] = [0, 1].map((k) => (low[k] + high[k]) / 2);
    const centre = [0, 1, 2].map((k) => u * axes[0][k] + v * axes[1][k]);
    fitted = { centre, width: Math.max(1e-9, high[0] - low[0]), height: Math.max(1e-9, high[1] - low[1]) };
  }

  // ---------------------------------------------------------------- drawing

  const css = (element, name) => getComputedStyle(element).getPropertyValue(name).trim();
  function rgb(colour) {
    const hex = colour.replace("#", ""), full = hex.length === 3 ? [...hex].map((c) => c + c).join("") : hex;
    return [0, 2, 4].map((i) => parseInt(full.slice(i, i + 2), 16));
  }
  const pixel = ([r, g, b], a) => ((a << 24) | (b << 16) | (g << 8) | r) >>> 0;
  let inks = null; // tables of the present theme, made when first needed
  function theme() {
    const surface = rgb(css(figure, "--surface")), rest = rgb(css(figure, "--rest"));
    const pale = rest.map((x, k) => 0.38 * x + 0.62 * surface[k]);
    inks = {
      own: solids.map((s) => { const c = rgb(css(s.panel, "--c")); return palette(() => c.map((x, k) => 0.9 * x + 0.12 * 255)); }),
      glass: palette(() => rgb(css(figure, "--soft"))), // with instruments.js
      ghost: palette(() => pale), edge: pixel(rgb(css(figure, "--ink")), 190), trace: pixel(rest, 235),
      ink: css(figure, "--ink"), soft: css(figure, "--soft"),
    };
  }

  function project(solid, axes, into, scale) {
    const { X, at } = solid, [right, up, near] = axes, [x0, y0, z0] = fitted.centre;
    for (let p = 0; p < X.length; p += 3) {
      const x = X[p] - x0, y = X[p + 1] - y0, z = X[p + 2] - z0;
      at[p] = into.width / 2 + scale * (right[0] * x + right[1] * y + right[2] * z);
      at[p + 1] = into.height / 2 - scale * (up[0] * x + up[1] * y + up[2] * z);
      at[p + 2] = scale * (near[0] * x + near[1] * y + near[2] * z);
    }
    lit(at, solid.triangles, solid.light);
  }

  function coloured(solid) {
    const tint = tinted(app, solid); // with carried.js
    if (tint) return tint.length ? [tint, errors] : [null, inks.ghost]; // with carried.js
    const byError = chosen("colour") === "error" && solid.error && solid.known;
    if (!byError) return [null, inks.own[solid.index]];
    const range = chosen("range"), most = (range === "clipped" ? data.clipped : data.most) || 1;
    const share = range === "log" ? (e) => 1 + Math.log10(Math.max(e / most, 1e-9)) / data.decades : (e) => e / most;
    for (let i = 0; i < solid.error.length; i++) solid.value[i] = share(solid.error[i]);
    return [solid.value, errors];
  }

  function sized(canvas) {
    // twice as fine as the screen, for smooth edges; not while something moves, when speed is worth more
    const ratio = (state.quick || state.playing ? 1 : 2) * Math.min(2, window.devicePixelRatio || 1);
    const width = Math.max(2, Math.round(canvas.clientWidth * ratio)), height = Math.max(2, Math.round(canvas.clientHeight * ratio));
    if (!canvas.frame || canvas.frame.width !== width || canvas.frame.height !== height) {
      canvas.width = width;
      canvas.height = height;
      canvas.frame = frame(width, height);
    }
    return ratio;
  }

  function picture(canvas, shown, behind, axes) {
    const ratio = sized(canvas), into = canvas.frame, margin = 26 * ratio;
    const scale = camera.zoom * Math.min((into.width - margin) / fitted.width, (into.height - margin) / fitted.height);
    wipe(into);
    let trace = null;
    if (behind) {
      project(behind, axes, into, scale);
      paint(into, behind.at, behind.triangles, behind.light, null, inks.ghost, 255);
      trace = into.owner.slice();
      into.owner.fill(0);
      into.depth.fill(-Infinity);
    }
    for (const solid of shown) {
      project(solid, axes, into, scale);
      paint(into, solid.at, solid.triangles, solid.light, ...coloured(solid), solid.index + 1);
    }
    const drawn = outline(into, into.owner, inks.edge);
    if (trace) outline(into, trace, inks.trace);
    veil(canvas, shown, into, (body, glass) => project(body, axes, glass, scale), inks.glass, inks.trace); // with instruments.js
    const pen = canvas.getContext("2d");
    pen.putImageData(into.image, 0, 0);
    rule(pen, into, scale, ratio);
    compass(pen, into, axes, ratio);
    canvas.scale = scale;
    return drawn;
  }

  // A length of 1, 2 or 5 times a power of ten.
  function rule(pen, into, scale, ratio) {
    const wanted = 0.28 * into.width / scale, decade = 10 ** Math.floor(Math.log10(wanted));
    const length = Math.max(...[1, 2, 5].map((m) => m * decade).filter((l) => l <= wanted), decade);
    const x = 10 * ratio, y = into.height - 10 * ratio;
    pen.strokeStyle = pen.fillStyle = inks.soft;
    pen.lineWidth = 1.5 * ratio;
    pen.beginPath();
    for (const [px, py] of [[0, -3], [0, 3]]) pen.moveTo(x + px, y + py * ratio), pen.lineTo(x + px, y);
    pen.moveTo(x, y);
    pen.lineTo(x + length * scale, y);
    for (const py of [-3, 3]) pen.moveTo(x + length * scale, y), pen.lineTo(x + length * scale, y + py * ratio);
    pen.stroke();
    pen.font = `${11 * ratio}px ${css(figure, "--sans")}`;
    pen.fillText(metres(length), x, y - 6 * ratio);
  }

  function compass(pen, into, axes, ratio) {
    const x = into.width - 24 * ratio, y = into.height - 22 * ratio, arm = 14 * ratio;
    pen.strokeStyle = pen.fillStyle = inks.soft;
    pen.lineWidth = 1.2 * ratio;
    pen.font = `${10.5 * ratio}px ${css(figure, "--sans")}`;
    ["x", "y", "z"].forEach((name, k) => {
      const dx = axes[0][k] * arm, dy = -axes[1][k] * arm;
      if (Math.hypot(dx, dy) < 0.2 * arm) return;
      pen.beginPath();
      pen.moveTo(x, y);
      pen.lineTo(x + dx, y + dy);
      pen.stroke();
      pen.fillText(name, x + 1.45 * dx - 3 * ratio, y + 1.45 * dy + 4 * ratio);
    });
  }

  const metres = (length) => {
    const [factor, unit] = length >= 1 ? [1, "m"] : length >= 1e-3 ? [1e3, "mm"] : length >= 1e-6 ? [1e6, "µm"] : [1e9, "nm"];
    return +(length * factor).toPrecision(3) + "\u00a0" + unit;
  };

  let waiting = false;
  function draw() {
    waiting = false;
    if (!stage.clientWidth) return;
    if (!inks) theme();
    const axes = basis(), behind = ghost(), all = stage.querySelector(".all");
    const shown = solids.filter((s) => s.shown);
    for (const solid of solids) if (solid.shown || solid === behind) pose(solid, state.time);
    stage.classList.toggle("overlaid", overlaid());
    let edges = 0, pictures = 0;
    if (overlaid()) {
      edges = picture(all, shown, shown.includes(behind) ? null : behind, axes);
      pictures = 1;
    } else for (const solid of shown) {
      edges += picture(solid.canvas, [solid], solid === behind ? null : behind, axes);
      pictures++;
    }
    const still = shown.some((s) => s.error && !s.known) && chosen("colour") === "error";
    get(".unknown").hidden = !still;
    unsure(app, shown); // with carried.js
    Object.assign(figure.dataset, { drawn: edges > 0, shapes: shown.length, pictures, edges });
  }
  const redraw = () => {
    if (!waiting) requestAnimationFrame(draw);
    waiting = true;
  };

  const app = { figure, stage, data, solids, camera, state, last, moving, get, chosen, overlaid, metres, draw, redraw, pose };
  app.view = (yaw, pitch) => {
    Object.assign(camera, { yaw: yaw * Math.PI / 180, pitch: pitch * Math.PI / 180, zoom: 1 });
    fit();
    redraw();
  };
  app.restyle = () => {
    inks = null;
    redraw();
  };
  carry(app); // with carried.js
  app.view(...data.view);
  figure.classList.add("live");
  controls(app);
  draw();
});
