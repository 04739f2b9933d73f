// How readers turn, choose and play: by pointer, by touch and by key.
function controls(app) {
  const { figure, stage, solids, camera, state, last, get, redraw } = app;
  const TURN = Math.PI / 18, spoken = get(".spoken");
  const say = (words) => { spoken.textContent = words; };

  function turn(yaw, pitch) {
    camera.yaw += yaw;
    camera.pitch = Math.max(-Math.PI / 2, Math.min(Math.PI / 2, camera.pitch + pitch));
    redraw();
  }
  function zoom(factor) {
    camera.zoom = Math.max(0.3, Math.min(20, camera.zoom * factor));
    redraw();
  }
  const home = () => app.view(...app.data.view);

  // ---------------------------------------------------------------- keys

  const keys = {
    ArrowLeft: () => turn(TURN, 0), ArrowRight: () => turn(-TURN, 0), ArrowUp: () => turn(0, TURN), ArrowDown: () => turn(0, -TURN),
    "+": () => zoom(1.25), "=": () => zoom(1.25), "-": () => zoom(0.8), 0: home, Home: home, " ": () => play(!state.playing),
  };
  stage.addEventListener("keydown", (event) => {
    if (!keys[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    keys[event.key]();
    const degrees = (angle) => Math.round(angle * 180 / Math.PI);
    say(`turned to ${degrees(camera.yaw)}°, from ${degrees(camera.pitch)}° above, zoom ${camera.zoom.toFixed(2)}`);
  });

  // ---------------------------------------------------------------- pointers

  const held = new Map();
  let apart = 0;
  const spread = () => {
    const [a, b] = [...held.values()];
    return Math.hypot(a.x - b.x, a.y - b.y);
  };
  stage.addEventListener("pointerdown", (event) => {
    if (!event.target.closest("canvas")) return;
    held.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (held.size === 2) apart = spread();
    event.target.setPointerCapture(event.pointerId);
    stage.classList.add("turning");
  });
  stage.addEventListener("pointermove", (event) => {
    const from = held.get(event.pointerId);
    if (!from) return read(event);
    const dx = event.clientX - from.x, dy = event.clientY - from.y;
    held.set(event.pointerId, { x: event.clientX, y: event.clientY });
    hush();
    state.quick = true;
    if (held.size === 1) turn(-dx / 120, dy / 120);
    else if (held.size === 2) {
      zoom(spread() / (apart || 1));
      apart = spread();
    }
  });
  for (const end of ["pointerup", "pointercancel"])
    stage.addEventListener(end, (event) => {
      held.delete(event.pointerId);
      if (held.size) return;
      stage.classList.remove("turning");
      state.quick = false;
      redraw();
    });
  // the wheel scrolls the page unless the figure has been clicked on
  stage.addEventListener("wheel", (event) => {
    if (!stage.contains(document.activeElement) && !event.ctrlKey) return;
    event.preventDefault();
    zoom(Math.exp(-event.deltaY / 500));
  }, { passive: false });

  // ---------------------------------------------------------------- the error under the pointer

  const tip = document.createElement("div");
  tip.className = "tip";
  tip.hidden = true;
  stage.append(tip);
  const hush = () => { tip.hidden = true; };
  stage.addEventListener("pointerleave", hush);

  function read(event) {
    const canvas = event.target.closest("canvas"), box = canvas && canvas.getBoundingClientRect();
    if (!canvas || !canvas.frame) return hush();
    const { width, height, owner, facet } = canvas.frame;
    const x = Math.floor((event.clientX - box.left) / box.width * width), y = Math.floor((event.clientY - box.top) / box.height * height);
    const solid = solids[owner[y * width + x] - 1];
    const beside = !solid && instrumentAt(app, canvas, x, y); // with instruments.js
    if (beside) return show(event, beside.name, ["rigid"]); // with instruments.js
    if (!solid) return hush();
    const t = facet[y * width + x], p = nearest(solid, t, x, y);
    const place = [0, 1, 2].map((k) => "xyz"[k] + "\u00a0" + app.metres(Math.abs(solid.X[3 * p + k])).replace(/^/, solid.X[3 * p + k] < 0 ? "−" : ""));
    const known = solid.error && solid.known ? [`${app.metres(solid.error[p])} from ${solid.against}`] : [];
    known.push(...told(app, solid, p)); // with carried.js
    show(event, solid.name, [...known, place.join("  ")]);
  }

  function nearest(solid, t, x, y) {
    let best = 0, least = Infinity;
    for (const p of solid.triangles.subarray(t, t + 3)) {
      const d = Math.hypot(solid.at[3 * p] - x, solid.at[3 * p + 1] - y);
      if (d < least) [least, best] = [d, p];
    }
    return best;
  }

  function show(event, name, lines) {
    const bold = document.createElement("b");
    bold.textContent = name;
    tip.replaceChildren(bold, ...lines.map((words) => {
      const line = document.createElement("span");
      line.textContent = words;
      return line;
    }));
    tip.hidden = false;
    const outer = stage.getBoundingClientRect(), x = event.clientX - outer.left, y = event.clientY - outer.top;
    tip.style.left = Math.max(0, x + 16 + tip.offsetWidth > outer.width ? x - 12 - tip.offsetWidth : x + 16) + "px";
    tip.style.top = Math.max(0, y - tip.offsetHeight - 8) + "px";
  }

  // ---------------------------------------------------------------- boxes and buttons

  const boxes = figure.querySelectorAll(".who input");
  boxes.forEach((box, i) => box.addEventListener("change", () => {
    solids[i].shown = box.checked;
    solids[i].panel.hidden = !box.checked;
    redraw();
  }));
  solids.forEach((s) => { s.panel.hidden = !s.shown; });
  figure.querySelectorAll("input[type=radio], select").forEach((input) => input.addEventListener("change", redraw));
  figure.querySelectorAll("button[data-view]").forEach((button) => button.addEventListener("click", () => {
    app.view(...button.dataset.view.split(" ").map(Number));
    say(button.textContent);
  }));
  for (const [name, act] of [["in", () => zoom(1.25)], ["out", () => zoom(0.8)], ["home", home]])
    get(`button[data-zoom="${name}"]`).addEventListener("click", act);
  get("button.points").addEventListener("click", () => save(app));

  // ---------------------------------------------------------------- time

  const slider = get("input[type=range]"), button = get("button.play"), clock = get("output");
  const still = matchMedia("(prefers-reduced-motion: reduce)").matches; // then a button press is one step
  let started = 0;
  const states = (app.solids.find((solid) => solid.labels) || {}).labels; // of an analysis with several: then no moments
  function at(time) {
    state.time = Math.max(0, Math.min(last, states && !state.playing ? Math.round(time) : time));
    slider.value = Math.round(1000 * state.time / last);
    clock.textContent = states ? states[Math.round(state.time)] : state.time.toFixed(last < 10 ? 3 : 1) + "\u00a0s";
    slider.setAttribute("aria-valuetext", clock.textContent);
    redraw();
  }
  function play(on) {
    if (!slider || (!on && !state.playing)) return;
    if (on && still) return at(state.time >= last ? 0 : state.time + (states ? 1 : last / 40));
    state.playing = on;
    redraw();
    button.textContent = on ? "Pause" : "Play";
    if (on && state.time >= last) at(0);
    started = performance.now() - 1000 * state.time;
    if (on) requestAnimationFrame(tick);
  }
  function tick(now) {
    if (!state.playing) return;
    at((now - started) / 1000);
    if (state.time >= last) return play(false);
    requestAnimationFrame(tick);
  }
  if (slider) {
    slider.addEventListener("input", () => {
      play(false);
      at(last * slider.value / 1000);
    });
    button.addEventListener("click", () => play(!state.playing));
    if (still) button.textContent = "Next";
    at(last);
  }

  // ---------------------------------------------------------------- paper

  new ResizeObserver(redraw).observe(stage);
  for (const media of ["print", "(prefers-color-scheme: dark)"])
    matchMedia(media).addEventListener("change", () => { app.restyle(); app.draw(); });
  window.addEventListener("beforeprint", () => { play(false); app.restyle(); app.draw(); });
}

// All points as they are drawn, as a CSV file.
function save(app) {
  const lines = ["name,point,x [m],y [m],z [m],error [m]"];
  lines[0] += app.data.carried.map((c) => `,${c.words.replace(",", "")} [${c.unit}]`).join(""); // with carried.js
  const quoted = (name) => `"${(/^[=+@-]/.test(name) ? "'" : "") + name.replace(/"/g, '""')}"`;
  for (const solid of app.solids) {
    app.pose(solid, app.state.time);
    for (let p = 0; p < solid.points; p++) {
      const place = [0, 1, 2].map((k) => solid.X[3 * p + k].toPrecision(6));
      lines.push([quoted(solid.name), p, ...place, solid.error && solid.known ? solid.error[p].toPrecision(5) : ""].join(","));
      lines[lines.length - 1] += app.data.carried.map((_, i) => "," + exact(solid, i, p)).join(""); // with carried.js
    }
  }
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([lines.join("\r\n") + "\r\n"], { type: "text/csv" }));
  link.download = "shapes.csv";
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
