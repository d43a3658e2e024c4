// A picture that is watched while it is rendered: canvas, controls, chart. It runs in a page of the package's own server
// (host.js) and in a notebook (anywidget). Both give it a model with on and send. A message is what has changed of the
// state, and the bytes of a picture or of a file.

const KEYS = { KeyW: "w", KeyA: "a", KeyS: "s", KeyD: "d", KeyQ: "q", KeyE: "e", KeyI: "i", KeyO: "o",
  ArrowLeft: "Left", ArrowRight: "Right", ArrowUp: "Up", ArrowDown: "Down" };
const COLOURS = ["#2f7fc1", "#d1495b", "#2f9e5b", "#9467bd", "#d9820b", "#17a2b8", "#a0664f", "#6b7f93"];
const HELP = "Drag: orbit. Right button, or two fingers: nearer, farther. Shift and drag: shift. Wheel: nearer, farther. "
  + "w a s d q e: move the eye. Arrows: move the point looked at. i o: nearer, farther. r: reset the camera. "
  + "z: zoom into the pixels; then dragging shifts the section. p: save the picture. c: copy the camera. m: hide or show the "
  + "controls. h: hide or show this help.";

const SLOW = new Set(["explain", "use", "split", "triangle_test", "lamp_choice", "ground", "environment", "control"]);
const MOVES = 20; // milliseconds between two events of the pointer
const POINTS = 120; // milliseconds for which the pointer rests before its pixel is asked for
const ZOOMS = [0, 1, 2, 4, 8, 16]; // points of the page for a pixel; 0 fits the picture into the page
const LEVELS = 64; // of the histogram
const ENDED = "The kernel has ended: run the cell again. This is its last picture.";
const BUSY = "One moment: this has to be compiled first ...";

function make(name, attributes = {}, ...children) {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) element[key] = value;
    else if (value !== null && value !== undefined) element.setAttribute(key, value);
  }
  element.append(...children);
  return element;
}

const button = (text, onclick, attributes = {}) => make("button", { type: "button", onclick, ...attributes }, text);
const three = value => String(Number(Number(value).toPrecision(3)));

function render({ model, el }) {
  const send = event => {
    if (SLOW.has(event.type)) busy = setTimeout(() => { message.textContent = BUSY; cancel.hidden = false; }, 300);
    flush();
    model.send(event);
  };
  // Movements of the pointer come faster than pictures: they are added up.
  let moved = null, moveTimer = 0;
  const flush = () => {
    clearTimeout(moveTimer);
    moveTimer = 0;
    if (moved) model.send(moved);
    moved = null;
  };
  const move = event => {
    if (moved && moved.type !== event.type) flush();
    if (!moved) moved = event;
    else for (const name of ["dx", "dy", "by"]) if (name in event) moved[name] += event[name];
    if (!moveTimer) moveTimer = setTimeout(flush, MOVES);
  };
  const canvas = make("canvas", { tabindex: 0, role: "application", "aria-label": "the picture: keys move the camera" });
  const status = make("p", { class: "tt-status" });
  const spoken = make("p", { class: "tt-spoken", role: "status" });
  const divider = make("input", { type: "range", min: 0, max: 1, step: 0.005, value: 0.5, class: "tt-divider",
    "aria-label": "how much of the left picture is shown", oninput: () => draw() });
  const compare = make("div", { class: "tt-compare", role: "group", "aria-label": "two pictures" });
  const scale = make("div", { class: "tt-scale" });
  const views = make("div", { class: "tt-views" });
  const settings = make("div", { class: "tt-settings" });
  const chart = make("div", { class: "tt-chart" });
  const told = make("div", { class: "tt-told" });
  const message = make("p", { class: "tt-message", role: "alert" });
  const cancel = button("Cancel", () => send({ type: "cancel" }), { hidden: "" });
  const pointed = make("p", { class: "tt-pointed" });
  const help = make("p", { class: "tt-help" }, HELP);
  const histogram = make("details", { class: "tt-chart", ontoggle: () => showHistogram() }, make("summary", {}, "Histogram"), make("div"));
  const zoom = make("select", { "aria-label": "zoom", onchange: () => setZoom(Number(zoom.value)) },
    ...ZOOMS.map(z => make("option", { value: z }, z ? `${z}×` : "fit")));
  const section = make("div", { class: "tt-section" }, canvas);
  const place = make("form", { class: "tt-place", hidden: "", onsubmit: event => {
    event.preventDefault();
    const [column, row, sample] = [...place.elements].slice(0, 3).map(input => Number(input.value));
    send({ type: "explain", column, row, sample });
  } }, ...["Column", "Row", "Sample"].map(name => make("label", {}, name,
    make("input", { type: "number", min: 0, step: 1, value: 0, required: "" }))), make("button", {}, "Explain"));
  const explain = button("Explain a pixel", () => {
    isAsking = !isAsking;
    explain.setAttribute("aria-pressed", String(isAsking));
    canvas.classList.toggle("tt-asking", isAsking);
    place.hidden = !isAsking;
  }, { "aria-pressed": "false" });
  const buttons = make("div", { class: "tt-buttons" }, explain,
    button("Reset camera", () => send({ type: "reset" })), make("label", {}, "Zoom ", zoom), button("The same again", () => send({ type: "same" })),
    ...["png", "exr"].map(kind => button(`Save ${kind.toUpperCase()}`, () => send({ type: "save", kind }))));
  el.classList.add("tt-live");
  el.setAttribute("data-lm-suppress-shortcuts", "true"); // in JupyterLab, d d would delete the cell
  const heading = make("h1", { class: "tt-heading" }), skip = make("a", { class: "tt-skip", href: "#", onclick: event => {
    event.preventDefault();
    canvas.focus();
  } }, "Skip to the picture");
  el.replaceChildren(skip, heading,
    make("div", { class: "tt-left" }, views),
    make("div", { class: "tt-middle" }, make("div", { class: "tt-picture" }, section, divider), scale, status, pointed, message, cancel,
      compare, buttons, place, told, help, spoken),
    make("div", { class: "tt-right" }, settings, chart, histogram));
  const context = canvas.getContext("2d", { alpha: false });
  let state = {}, bitmap = null, isAsking = false, frames = [], spokenAt = 0, shownAt = 0, busy = 0, last = Promise.resolve();
  let [shownViews, shownSettings, shownCurves, shownTold, shownSplit] = ["", "", "", "", ""];
  let pointer = null, pointTimer = 0, isCopying = false;
  let exposureBefore = null; // while the exposure that fits is awaited

  // ── frames ──

  async function onMessage(next, bytes) {
    if ("offered" in next || next.lost || next.file) { clearTimeout(busy); cancel.hidden = true; }
    if (next.file) { keep(next.file, bytes); return; }
    if (bytes && bytes.byteLength) {
      const decoded = await createImageBitmap(new Blob([bytes], { type: `image/${next.kind}` }));
      bitmap?.close();
      bitmap = decoded;
    }
    if (next.id) send({ type: "ack", id: next.id });
    state = { ...state, ...next };
    if (!bitmap || !state.offered) { message.textContent = state.lost ?? ""; return; }
    draw();
    Object.assign(canvas.dataset, { frame: state.id, kind: state.kind, samples: state.samples });
    if (bytes && bytes.byteLength) {
      const now = performance.now();
      frames = [...frames.filter(time => now - time < 1000), now];
    }
    show("offered" in next);
  }

  // A picture that moves may be smaller than the canvas; of two halves, both are in it, one beside the other.
  function draw() {
    if (!bitmap || !state.width) return;
    const { width, height } = state, isDouble = state.split?.mode === "sides", from = bitmap.width / (isDouble ? 2 : 1);
    if (canvas.width !== width || canvas.height !== height) {
      [canvas.width, canvas.height] = [width, height];
      el.style.setProperty("--aspect", width / height);
    }
    context.imageSmoothingEnabled = false;
    if (!isDouble) { context.drawImage(bitmap, 0, 0, width, height); return; }
    const cut = Math.round(divider.value * width), share = from / width;
    if (cut > 0) context.drawImage(bitmap, 0, 0, cut * share, bitmap.height, 0, 0, cut, height);
    if (cut < width) context.drawImage(bitmap, from + cut * share, 0, from - cut * share, bitmap.height, cut, 0, width - cut, height);
    if (cut > 0 && cut < width) { context.fillStyle = "#fff"; context.fillRect(cut - 1, 0, 2, height); }
  }

  function keep(name, bytes) {
    const link = make("a", { href: URL.createObjectURL(new Blob([bytes])), download: name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    say(`${name} is saved`);
  }

  function say(text) { spoken.textContent = text; spokenAt = performance.now(); }

  const describe = ({ view, samples, error }) => `${view}: ${samples} ${samples === 1 ? "sample" : "samples"} per pixel`
    + (error ? `, error ${error}` : "");

  function show(isAll) {
    const now = performance.now();
    if (!isAll && state.kind === "jpeg" && now - shownAt < 200) return; // nobody reads numbers that change faster
    shownAt = now;
    const sides = state.split ? state.sides.map((side, k) => `${k ? "right" : "left"} ${describe(side)}`) : [describe(state)];
    status.textContent = sides.join("; ") + (frames.length > 2 ? `, ${frames.length} frames/s` : "");
    const text = state.lost || state.message;
    if (message.textContent !== text) message.textContent = text;
    showScale(); showPointed(); showHistogram();
    if (!isAll) return;
    if (performance.now() - spokenAt > 10000 || !spoken.textContent.startsWith(state.view)) say(sides.join("; "));
    showViews(); showSettings(); showChart(); showSplit();
    if (shownTold === state.explanation) return;
    told.innerHTML = shownTold = state.explanation;
    const copy = async text => { await navigator.clipboard.writeText(text); say("It is copied."); };
    for (const text of told.querySelectorAll("pre")) text.after(button("Copy", () => copy(text.textContent)));
    if (shownTold) told.prepend(button("Close", () => { send({ type: "close" }); canvas.focus(); }, { class: "tt-close" }));
    if (isCopying) copy(told.querySelector("pre").textContent).catch(() => {}); // a browser may forbid it: the button is there
    isCopying = false;
  }

  // ── the pixel under the pointer, and the section that is shown ──

  function showPointed() {
    const { pointed: told } = state, isHere = pointer && told?.column === pointer[0] && told.row === pointer[1];
    const side = state.split?.mode === "sides" && pointer?.[0] >= divider.value * state.width ? 1 : 0;
    const values = state.split?.mode === "difference" ? `left ${told?.values[0]}, right ${told?.values[1]}` : told?.values[side];
    const text = !pointer ? "" : `Column ${pointer[0]}, row ${pointer[1]}` + (isHere ? `: ${values}; sees ${told.place}` : "");
    if (pointed.textContent !== text) pointed.textContent = text;
  }

  const pixelAt = event => {
    const { left, top, width, height } = box(), inside = (share, size) => Math.max(0, Math.min(size - 1, Math.floor(share * size)));
    return [inside((event.clientX - left) / width, canvas.width), inside((event.clientY - top) / height, canvas.height)];
  };

  function pointAt(event) {
    clearTimeout(pointTimer);
    pointer = event && pixelAt(event);
    if (pointer) pointTimer = setTimeout(() => send({ type: "point", column: pointer[0], row: pointer[1] }), POINTS);
    else send({ type: "leave" });
    showPointed();
  }

  // The pixel that was under the pointer, or in the middle, stays where it is.
  function setZoom(value) {
    const frame = section.getBoundingClientRect(), before = box();
    const x = pointer ? pointer[0] / canvas.width : 0.5, y = pointer ? pointer[1] / canvas.height : 0.5;
    const [left, top] = [before.left + x * before.width - frame.left, before.top + y * before.height - frame.top];
    zoom.value = value;
    section.classList.toggle("tt-zoomed", value > 0);
    canvas.style.width = value ? `${value * canvas.width}px` : "";
    [section.scrollLeft, section.scrollTop] = [x * canvas.offsetWidth - left, y * canvas.offsetHeight - top];
  }

  // ── how often each level of red, green and blue occurs in the bytes that are shown ──

  function showHistogram() {
    if (!histogram.open || !bitmap || (state.kind === "jpeg" && histogram.dataset.of)) return;
    if (histogram.dataset.of === `${state.id}`) return;
    histogram.dataset.of = state.id;
    const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d", { willReadFrequently: true });
    copy.drawImage(canvas, 0, 0);
    const { data } = copy.getImageData(0, 0, canvas.width, canvas.height), counts = [0, 1, 2].map(() => new Array(LEVELS).fill(0));
    let [dark, white] = [0, 0];
    for (let i = 0; i < data.length; i += 4) {
      for (let k = 0; k < 3; k++) counts[k][Math.floor(data[i + k] * LEVELS / 256)]++;
      if (data[i] + data[i + 1] + data[i + 2] === 0) dark++;
      if (Math.max(data[i], data[i + 1], data[i + 2]) === 255) white++;
    }
    const [w, h] = [280, 90], most = Math.max(...counts.flat()), share = n => `${three(400 * n / data.length)} %`;
    const lines = counts.map((of, k) => `<polyline class="tt-level${k}" fill="none" stroke-width="1.5" points="`
      + of.map((n, i) => `${(i * w / (LEVELS - 1)).toFixed(1)},${(h - 2 - (h - 6) * Math.sqrt(n / most)).toFixed(1)}`).join(" ") + '"/>');
    histogram.lastChild.innerHTML = `<svg viewBox="0 0 ${w} ${h}" role="img" aria-label="histogram of red, green and blue">`
      + `<line x1="0" x2="${w}" y1="${h - 1}" y2="${h - 1}" class="tt-grid"/>${lines.join("")}</svg>`
      + `<p>0 to 255; heights are square roots. Black: ${share(dark)} of the pixels; a channel at 255: ${share(white)}.</p>`;
  }

  // ── two pictures ──

  function showSplit() {
    const { split } = state, key = JSON.stringify([split, state.sides.map(side => side.view)]);
    divider.hidden = split?.mode !== "sides";
    if (key === shownSplit) return;
    const focused = compare.contains(document.activeElement) ? document.activeElement.textContent : null;
    shownSplit = key;
    const choose = (text, event, isOn) => button(text, () => send(event), { "aria-pressed": String(Boolean(isOn)) });
    const modes = [["One picture", "off"], ["Compare two", "sides"], ["Difference", "difference"]];
    compare.replaceChildren(...modes.map(([text, mode]) => choose(text, { type: "split", mode }, (split?.mode ?? "off") === mode)));
    if (split) compare.append(make("span", {}, " Change: "), ...["left", "right"].map((side, number) =>
      choose(`${side}: ${state.sides[number].view}`, { type: "side", number }, split.side === number)));
    if (focused) [...compare.querySelectorAll("button")].find(one => one.textContent === focused)?.focus();
    draw();
  }

  function showScale() {
    const { scale: map } = state, key = map ? `${map.low} ${map.high} ${map.text}` : "";
    if (scale.dataset.key === key) return;
    scale.dataset.key = key;
    scale.replaceChildren(...(map ? [make("span", {}, map.low), make("i"), make("span", {}, map.high), make("span", {}, ` ${map.text}`)] : []));
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
    const shown = make("span", {}, three(value));
    const input = make("input", { type: "range", min: low, max: high, step, value, "data-name": label, oninput: e => {
      shown.textContent = three(e.target.value);
      onchange(Number(e.target.value));
    } });
    return make("label", {}, `${label} `, shown, input);
  }

  function showSettings() {
    const { controls, exposure, tone, fov, white } = state;
    heading.textContent = state.scene;
    if (exposureBefore !== null && exposure !== exposureBefore) [exposureBefore, shownSettings] = [null, ""]; // the slider moves
    const key = JSON.stringify([state.environment, state.triangle_test, state.lamp_choice, state.lamp_choices, state.ground, controls.map(
      c => c.kind === "slider" ? c.name : c), exposure === null, tone, fov === null, white === null]);
    if (key === shownSettings) return;
    const active = document.activeElement;
    if (settings.contains(active) && active.type === "range" && active.matches(":active")) return; // it is being dragged
    shownSettings = key;
    const parts = [choice("Environment", state.environment, state.environments, "environment")];
    if (state.triangle_tests.length > 1) parts.push(choice("Triangle test", state.triangle_test, state.triangle_tests, "triangle_test"));
    if (state.lamp_choices.length > 1) parts.push(choice("Choice of lamps", state.lamp_choice, state.lamp_choices, "lamp_choice"));
    parts.push(choice("Ground", state.ground, state.grounds, "ground"));
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
      parts.push(make("button", { onclick: () => { exposureBefore = exposure; send({ type: "expose" }); } }, "Expose to fit"));
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
    const [w, h, left, bottom] = [280, 190, 44, 40];
    const range = values => { const [a, b] = [Math.min(...values), Math.max(...values)]; return [Math.log(a / 1.2), Math.log(b * 1.2)]; };
    const [x0, x1] = range(all.map(p => p[0])), [y0, y1] = range(all.map(p => p[1]));
    const x = s => left + (w - left - 6) * (Math.log(s) - x0) / (x1 - x0), y = e => (h - bottom) - (h - bottom - 8) * (Math.log(e) - y0) / (y1 - y0);
    const lines = curves.map(([name, points], i) => {
      const colour = COLOURS[i % COLOURS.length];
      const places = points.filter(([s, e]) => s > 0 && e > 0).map(([s, e]) => [x(s).toFixed(1), y(e).toFixed(1), s, e]);
      const dots = places.map(([cx, cy, s, e]) => `<circle cx="${cx}" cy="${cy}" r="2.5" fill="${colour}"/><circle cx="${cx}" cy="${cy}" r="8" `
        + `fill="transparent"><title>${name}: ${three(100 * e)} % after ${three(s)} s</title></circle>`);
      return `<polyline points="${places.map(([cx, cy]) => `${cx},${cy}`).join(" ")}" fill="none" stroke="${colour}" stroke-width="1.5"/>${dots.join("")}`
        + `<text x="${w - 4}" y="${14 + 14 * i}" text-anchor="end" style="fill:${colour}">${name}</text>`;
    });
    const ticks = (low, high) => { const found = []; for (let k = Math.floor(low / Math.LN10); k <= Math.ceil(high / Math.LN10); k++)
      for (const step of high - low > 2 ? [1, 2, 5] : [1, 1.5, 2, 3, 4, 5, 6, 8]) { const v = step * 10 ** k; if (Math.log(v) >= low && Math.log(v) <= high) found.push(v); } return found; };
    const down = ticks(y0, y1).map(v => `<line x1="${left}" x2="${w}" y1="${y(v)}" y2="${y(v)}" class="tt-grid"/>`
      + `<text x="${left - 4}" y="${y(v) + 4}" text-anchor="end">${Number((100 * v).toPrecision(2))} %</text>`);
    let last = -99;
    const across = ticks(x0, x1).filter(v => { if (x(v) - last < 34) return false; last = x(v); return true; })
      .map(v => `<text x="${x(v)}" y="${h - 24}" text-anchor="middle">${Number(v.toPrecision(2))}</text>`);
    const axes = `<path d="M${left} 4V${h - bottom}H${w}" fill="none" stroke="currentColor"/><text x="${(left + w) / 2}" y="${h - 6}" `
      + `text-anchor="middle">seconds of rendering</text><text x="4" y="${h - 6}">error</text>`;
    chart.innerHTML = `<svg viewBox="0 0 ${w} ${h}" role="img" aria-label="error against seconds of rendering">${down.join("")}${across.join("")}${axes}${lines.join("")}</svg>`;
  }

  // ── keys, pointer, wheel ──

  const box = () => canvas.getBoundingClientRect();
  const PRESSED = { KeyR: () => send({ type: "reset" }), KeyP: () => send({ type: "save", kind: "png" }),
    KeyC: () => { isCopying = true; send({ type: "camera" }); }, KeyH: () => { help.hidden = !help.hidden; },
    KeyM: () => el.classList.toggle("tt-alone"),
    KeyZ: () => setZoom(ZOOMS[(ZOOMS.indexOf(Number(zoom.value)) + 1) % ZOOMS.length]) };
  canvas.onkeydown = event => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.code in PRESSED && !event.repeat) PRESSED[event.code]();
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
      [place.elements[0].value, place.elements[1].value] = pixelAt(event);
      place.requestSubmit();
      return;
    }
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    canvas.setPointerCapture(event.pointerId);
    event.preventDefault();
  };
  canvas.onpointermove = event => {
    const before = pointers.get(event.pointerId);
    if (!before) { pointAt(event); return; }
    if (Number(zoom.value)) {
      section.scrollBy(before.x - event.clientX, before.y - event.clientY);
      pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
      return;
    }
    const { width, height } = box(), apart = pointers.size === 2 ? spread() : 0;
    const dx = (event.clientX - before.x) / width, dy = (before.y - event.clientY) / height;
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (pointers.size === 2) move({ type: "zoom", by: (spread() - apart) / height });
    else if (event.buttons & 2) move({ type: "zoom", by: dy });
    else if (event.shiftKey) move({ type: "pan", dx, dy });
    else move({ type: "drag", dx, dy });
  };
  canvas.onpointerup = canvas.onpointercancel = event => pointers.delete(event.pointerId);
  canvas.onpointerleave = () => pointAt(null);
  canvas.oncontextmenu = event => event.preventDefault();
  canvas.addEventListener("wheel", event => {
    if (Number(zoom.value)) return; // it shifts the section
    event.preventDefault();
    const by = -Math.sign(event.deltaY) * Math.min(Math.abs(event.deltaY), 200) / 2000;
    if (by) move({ type: "zoom", by });
  }, { passive: false });

  const listener = (next, bytes) => { // one after the other: a picture that is decoded quickly must not overtake an older one
    last = last.then(() => onMessage(next, Array.isArray(bytes) ? bytes[0] : bytes)).catch(error => console.error(error));
    return last;
  };
  model.on("msg:custom", listener);
  const ended = () => { message.textContent = ENDED; cancel.hidden = true; clearTimeout(busy); };
  for (const name of ["comm:close", "comm_live_update"]) model.on(name, ended); // of notebooks
  send({ type: "ack", id: 0 });
  // Who watches says so now and then; a view that is closed or hidden is not rendered for long.
  const watching = setInterval(() => { if (!document.hidden && canvas.isConnected) send({ type: "ack", id: state.id ?? 0 }); }, 4000);
  return () => { clearInterval(watching); model.off("msg:custom", listener); clearTimeout(pointTimer); bitmap?.close(); send({ type: "blur" }); };
}

export default { render };
