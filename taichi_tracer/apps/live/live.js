// A picture that is watched while it is rendered: canvas, controls, chart. It runs in a page of the package's own server
// (host.js) and in a notebook (anywidget); both give it a model with on, send and, for each frame, (state, bytes).

const KEYS = { KeyW: "w", KeyA: "a", KeyS: "s", KeyD: "d", KeyQ: "q", KeyE: "e", KeyI: "i", KeyO: "o",
  ArrowLeft: "Left", ArrowRight: "Right", ArrowUp: "Up", ArrowDown: "Down" };
const COLOURS = ["#2f7fc1", "#d1495b", "#2f9e5b", "#9467bd", "#d9820b", "#17a2b8", "#a0664f", "#6b7f93"];
const HELP = "Drag: orbit. Right button, or two fingers: nearer, farther. Shift and drag: shift. Wheel: nearer, farther. "
  + "w a s d q e: move the eye. Arrows: move the point looked at. i o: nearer, farther. r: reset the camera.";

function make(name, attributes = {}, ...children) {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) element[key] = value;
    else if (value !== null && value !== undefined) element.setAttribute(key, value);
  }
  element.append(...children);
  return element;
}

function render({ model, el, files = false }) {
  const send = event => model.send(event);
  const canvas = make("canvas", { tabindex: 0, role: "img", "aria-label": "the picture" });
  const status = make("output", { class: "tt-status", "aria-live": "polite" });
  const views = make("div", { class: "tt-views" });
  const settings = make("div", { class: "tt-settings" });
  const chart = make("div", { class: "tt-chart" });
  const told = make("div", { class: "tt-told" });
  const message = make("p", { class: "tt-message", role: "alert" });
  const explain = make("button", { type: "button", "aria-pressed": "false", onclick: () => {
    isAsking = !isAsking;
    explain.setAttribute("aria-pressed", String(isAsking));
    canvas.classList.toggle("tt-asking", isAsking);
  } }, "Explain a pixel");
  const buttons = make("div", { class: "tt-buttons" }, explain,
    make("button", { type: "button", onclick: () => send({ type: "reset" }) }, "Reset camera"),
    make("button", { type: "button", onclick: () => send({ type: "same" }) }, "The same again"));
  if (files) buttons.append(make("a", { href: "picture.png", download: "picture.png", role: "button" }, "Save PNG"));
  el.classList.add("tt-live");
  el.replaceChildren(
    make("div", { class: "tt-left" }, views),
    make("div", { class: "tt-middle" }, canvas, status, message, buttons, make("p", { class: "tt-help" }, HELP), told),
    make("div", { class: "tt-right" }, settings, chart));
  const context = canvas.getContext("2d");
  let state = null, isAsking = false, shownViews = "", shownSettings = "", shownCurves = "", shownTold = "", frames = [];

  // ── frames ──

  async function onFrame(next, bytes) {
    if (next.lost) { message.textContent = next.lost; return; }
    if (bytes && bytes.byteLength) {
      const bitmap = await createImageBitmap(new Blob([bytes], { type: `image/${next.kind}` }));
      if (canvas.width !== bitmap.width || canvas.height !== bitmap.height) {
        canvas.width = bitmap.width; canvas.height = bitmap.height;
      }
      context.drawImage(bitmap, 0, 0);
      bitmap.close();
    }
    send({ type: "ack", id: next.id });
    state = next;
    canvas.dataset.frame = next.id; canvas.dataset.kind = next.kind; canvas.dataset.samples = next.samples;
    const now = performance.now();
    frames = [...frames.filter(time => now - time < 1000), now];
    show();
  }

  function show() {
    const error = state.error ? `, error ${state.error}` : "";
    status.textContent = `${state.view}: ${state.samples} ${state.samples === 1 ? "sample" : "samples"} per pixel${error}`
      + (frames.length > 2 ? `, ${frames.length} frames/s` : "");
    message.textContent = state.message;
    showViews(); showSettings(); showChart();
    if (shownTold !== state.explanation) { told.innerHTML = shownTold = state.explanation; }
  }

  // ── what can be chosen ──

  function showViews() {
    const key = JSON.stringify([state.offered, state.what, state.view]);
    if (key === shownViews) return;
    const focused = views.contains(document.activeElement) ? document.activeElement.dataset.name : null;
    shownViews = key;
    views.replaceChildren(...state.offered.map(({ what, names }) => make("fieldset", {},
      make("legend", {}, `${what}s`),
      ...names.map(([name, label]) => make("button", { type: "button", "data-name": `${what} ${name}`,
        "aria-pressed": String(what === state.what && name === state.view),
        onclick: () => send({ type: "use", what, name }) }, label)))));
    if (focused) views.querySelector(`[data-name="${CSS.escape(focused)}"]`)?.focus();
  }

  function choice(label, value, names, type) {
    return make("label", {}, label, make("select", { "data-name": type, onchange: e => send({ type, name: e.target.value }) },
      ...names.map(name => make("option", { value: name, ...(name === value ? { selected: "" } : {}) }, name.split("/").pop()))));
  }

  function slider(label, value, low, high, step, onchange) {
    const shown = make("span", {}, Number(value).toPrecision(3));
    const input = make("input", { type: "range", min: low, max: high, step, value, "data-name": label, oninput: e => {
      shown.textContent = Number(e.target.value).toPrecision(3);
      onchange(Number(e.target.value));
    } });
    return make("label", {}, `${label} `, shown, input);
  }

  function showSettings() {
    const { controls, exposure, tone, fov, white } = state;
    const key = JSON.stringify([state.environment, state.triangle_test, state.lamp_choice, state.lamp_choices, controls.map(
      c => c.kind === "slider" ? c.name : c), exposure === null, tone, fov === null, white === null]);
    if (key === shownSettings) return;
    const active = document.activeElement;
    if (settings.contains(active) && active.type === "range" && active.matches(":active")) return; // it is being dragged
    shownSettings = key;
    const parts = [choice("Environment", state.environment, state.environments, "environment")];
    if (state.triangle_tests.length > 1) parts.push(choice("Triangle test", state.triangle_test, state.triangle_tests, "triangle_test"));
    if (state.lamp_choices.length > 1) parts.push(choice("Choice of lamps", state.lamp_choice, state.lamp_choices, "lamp_choice"));
    for (const c of controls) {
      const change = value => send({ type: "control", name: c.name, value });
      if (c.kind === "slider") parts.push(slider(c.label, c.value, c.low, c.high, c.step, change));
      else if (c.kind === "name") parts.push(make("label", {}, c.label, make("select", { onchange: e => change(e.target.value) },
        ...c.names.map(name => make("option", { value: name, ...(name === c.value ? { selected: "" } : {}) }, name)))));
      else {
        const names = ["all", ...Array.from({ length: c.most + 1 }, (_, k) => String(k))];
        const value = c.value === null ? "all" : String(c.value[0]);
        parts.push(make("label", {}, "Light after bounces", make("select", { onchange: e => change(
          e.target.value === "all" ? null : [Number(e.target.value), Number(e.target.value)]) },
        ...names.map(name => make("option", { value: name, ...(name === value ? { selected: "" } : {}) }, name)))));
      }
    }
    if (exposure !== null) {
      parts.push(slider("Exposure", exposure, -10, 10, 0.125, value => send({ type: "exposure", value })));
      parts.push(choice("Tone curve", tone, state.tones, "tone"));
    }
    if (fov !== null) parts.push(slider("Field of view", fov, 5, 150, 0.5, value => send({ type: "fov", value })));
    if (white !== null) parts.push(slider("White at", white, white / 10, white * 4, white / 50, value => send({ type: "white", value })));
    settings.replaceChildren(...parts);
  }

  // ── the error against seconds ──

  function showChart() {
    const key = JSON.stringify(state.curves);
    if (key === shownCurves) return;
    shownCurves = key;
    const curves = Object.entries(state.curves).filter(([, points]) => points.length > 1);
    if (!curves.length) { chart.replaceChildren(); return; }
    const all = curves.flatMap(([, points]) => points).filter(([s, e]) => s > 0 && e > 0);
    const [w, h, left, bottom] = [280, 170, 44, 24];
    const range = values => { const [a, b] = [Math.min(...values), Math.max(...values)]; return [Math.log(a / 1.2), Math.log(b * 1.2)]; };
    const [x0, x1] = range(all.map(p => p[0])), [y0, y1] = range(all.map(p => p[1]));
    const x = s => left + (w - left - 6) * (Math.log(s) - x0) / (x1 - x0), y = e => (h - bottom) - (h - bottom - 8) * (Math.log(e) - y0) / (y1 - y0);
    const lines = curves.map(([name, points], i) => {
      const colour = COLOURS[i % COLOURS.length];
      const path = points.filter(([s, e]) => s > 0 && e > 0).map(([s, e]) => `${x(s).toFixed(1)},${y(e).toFixed(1)}`).join(" ");
      return `<polyline points="${path}" fill="none" stroke="${colour}" stroke-width="2"/>`
        + `<text x="${w - 4}" y="${14 + 14 * i}" text-anchor="end" style="fill:${colour}">${name}</text>`;
    });
    const ticks = (low, high) => { const found = []; for (let k = Math.floor(low / Math.LN10); k <= Math.ceil(high / Math.LN10); k++)
      for (const step of [1, 2, 5]) { const v = step * 10 ** k; if (Math.log(v) >= low && Math.log(v) <= high) found.push(v); } return found; };
    const down = ticks(y0, y1).map(v => `<line x1="${left}" x2="${w}" y1="${y(v)}" y2="${y(v)}" class="tt-grid"/>`
      + `<text x="${left - 4}" y="${y(v) + 4}" text-anchor="end">${Number((100 * v).toPrecision(2))} %</text>`);
    let last = -99;
    const across = ticks(x0, x1).filter(v => { if (x(v) - last < 34) return false; last = x(v); return true; })
      .map(v => `<text x="${x(v)}" y="${h - 8}" text-anchor="middle">${Number(v.toPrecision(2))} s</text>`);
    chart.innerHTML = `<svg viewBox="0 0 ${w} ${h}" role="img" aria-label="error against seconds">${down.join("")}${across.join("")}${lines.join("")}</svg>`;
  }

  // ── keys, pointer, wheel ──

  const box = () => canvas.getBoundingClientRect();
  canvas.onkeydown = event => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.code === "KeyR") send({ type: "reset" });
    const key = KEYS[event.code];
    if (!key) return;
    event.preventDefault();
    if (!event.repeat) send({ type: "key", key, down: true });
  };
  canvas.onkeyup = event => { const key = KEYS[event.code]; if (key) send({ type: "key", key, down: false }); };
  canvas.onblur = () => send({ type: "blur" });
  const pointers = new Map();
  const spread = () => { const [a, b] = [...pointers.values()]; return Math.hypot(a.x - b.x, a.y - b.y); };
  canvas.onpointerdown = event => {
    canvas.focus();
    if (isAsking) {
      const { left, top, width, height } = box();
      send({ type: "explain", column: Math.min(canvas.width - 1, Math.floor((event.clientX - left) / width * canvas.width)),
        row: Math.min(canvas.height - 1, Math.floor((event.clientY - top) / height * canvas.height)), sample: 0 });
      explain.click();
      return;
    }
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    canvas.setPointerCapture(event.pointerId);
    event.preventDefault();
  };
  canvas.onpointermove = event => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const { width, height } = box(), apart = pointers.size === 2 ? spread() : 0;
    const dx = (event.clientX - before.x) / width, dy = (before.y - event.clientY) / height;
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (pointers.size === 2) send({ type: "zoom", by: (spread() - apart) / height });
    else if (event.buttons & 2) send({ type: "zoom", by: dy });
    else if (event.shiftKey) send({ type: "pan", dx, dy });
    else send({ type: "drag", dx, dy });
  };
  canvas.onpointerup = canvas.onpointercancel = event => pointers.delete(event.pointerId);
  canvas.oncontextmenu = event => event.preventDefault();
  canvas.addEventListener("wheel", event => {
    event.preventDefault();
    const by = -Math.sign(event.deltaY) * Math.min(Math.abs(event.deltaY), 200) / 2000;
    if (by) send({ type: "zoom", by });
  }, { passive: false });

  const listener = (next, bytes) => onFrame(next, Array.isArray(bytes) ? bytes[0] : bytes);
  model.on("msg:custom", listener);
  send({ type: "ack", id: 0 });
  return () => { model.off("msg:custom", listener); send({ type: "blur" }); };
}

export default { render };
