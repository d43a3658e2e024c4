// A picture that is watched while it is rendered: canvas, controls, chart. It runs in a page of the package's own server
// (host.js) and in a notebook (anywidget). Both give it a model with on and send. A message is what has changed of the
// state, and the bytes of a picture or of a file.

const KEYS = { KeyW: "w", KeyA: "a", KeyS: "s", KeyD: "d", KeyQ: "q", KeyE: "e", KeyI: "i", KeyO: "o",
  ArrowLeft: "Left", ArrowRight: "Right", ArrowUp: "Up", ArrowDown: "Down" };
const COLOURS = ["#2f7fc1", "#d1495b", "#2f9e5b", "#9467bd", "#d9820b", "#17a2b8", "#a0664f", "#6b7f93"];
const HELP = [
  ["drag", "orbit around the point looked at"],
  ["right button, two fingers, wheel", "nearer, farther"], ["shift and drag", "shift the picture"],
  ["w a s d q e", "move the eye"], ["arrow keys", "move the point looked at"], ["i o", "nearer, farther"],
  ["r", "reset the camera"], ["z", "zoom into the pixels; dragging then shifts them; at 64× their numbers are shown"],
  ["x", "explain a pixel: choose it in the picture"], ["f", "compare: left or right alone, and both again"],
  ["p", "save the picture"], ["c", "copy the camera as options of the command line"],
  ["m", "hide or show the panel"], ["?", "this help"],
];
const MOVES = 20; // milliseconds between two events of the pointer
const POINTS = 60; // milliseconds for which the pointer rests before its pixel is asked for
const RESIZES = 250; // milliseconds after the last change of the window before the picture gets another size
const ZOOMS = [0, 1, 2, 4, 8, 16, 32, 64], NUMBERS = 64; // 0 fits the picture; from NUMBERS on, pixels show their numbers
const LEVELS = 64; // of the histogram
const MODES = ["off", "sides", "difference"]; // of two pictures
const WORDS = [[2, "clean"], [6, "slightly grainy"], [20, "grainy"], [Infinity, "very grainy"]]; // up to so many per cent
const ENDED = "The kernel has ended: run the cell again. This is its last picture.";

function make(name, attributes = {}, ...children) {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) element[key] = value;
    else if (value !== null && value !== undefined && value !== false) element.setAttribute(key, value === true ? "" : value);
  }
  element.append(...children);
  return element;
}

const button = (text, onclick, attributes = {}) => make("button", { type: "button", onclick, ...attributes }, text);
const rounded = (value, digits) => String(Number(Number(value).toPrecision(digits)));
const three = value => rounded(value, 3), two = value => rounded(value, 2);
const setText = (element, text) => { if (element.textContent !== text) element.textContent = text; };

// A button that opens a box below it; Escape, or a click elsewhere, closes it.
function menu(text, content, attributes = {}, atEnd = false) {
  const box = make("div", { hidden: true, class: atEnd ? "tt-end" : null }, ...content);
  const opener = button(text, () => open(box.hidden), { "aria-expanded": "false", ...attributes });
  const open = isOpen => {
    box.hidden = !isOpen;
    opener.setAttribute("aria-expanded", String(isOpen));
    if (isOpen) box.querySelector("input, button")?.focus();
  };
  const whole = make("div", { class: "tt-menu", onkeydown: event => {
    if (event.key === "Escape") { open(false); opener.focus(); }
  } }, opener, box);
  const elsewhere = event => { if (!event.composedPath().includes(whole)) open(false); };
  document.addEventListener("pointerdown", elsewhere);
  return { whole, opener, box, close: () => open(false), end: () => document.removeEventListener("pointerdown", elsewhere) };
}

function render({ model, el }) {
  let state = {}, bitmap = null, frames = [], spokenAt = 0, shownAt = 0, last = Promise.resolve();
  let isAsking = false, isCopying = false, pointer = null, pointTimer = 0, zoom = 0, border = 0.5, busySince = 0, strips = 0;
  const shown = {}; // what each part of the page was made of, so that it is made again only when that changes
  const isPage = Boolean(el.closest(".tt-page"));
  const changed = (part, key) => {
    if (shown[part] === key) return false;
    shown[part] = key;
    return true;
  };

  // ── events to the program ──

  let moved = null, moveTimer = 0;
  const flush = () => {
    clearTimeout(moveTimer);
    moveTimer = 0;
    if (moved) model.send(moved);
    moved = null;
  };
  const send = event => { flush(); model.send(event); };
  const set = (name, value) => send({ type: "set", name, value });
  const move = event => { // movements of the pointer come faster than pictures: they are added up
    if (moved && moved.type !== event.type) flush();
    if (!moved) moved = event;
    else for (const name of ["dx", "dy", "by"]) if (name in event) moved[name] += event[name];
    if (!moveTimer) moveTimer = setTimeout(flush, MOVES);
  };

  // ── the parts of the page ──

  const canvas = make("canvas", { tabindex: 0, role: "application", "aria-label": "the picture: keys move the camera" });
  const mark = make("div", { class: "tt-mark", hidden: true }), values = make("div", { class: "tt-values" });
  const divider = make("div", { class: "tt-divider", role: "slider", tabindex: 0, hidden: true, "aria-valuemin": 0,
    "aria-valuemax": 100, "aria-label": "how much of the left picture is shown, in per cent", title: "drag the border; f shows one picture alone" });
  const sides = [0, 1].map(k => make("span", { class: "tt-side", hidden: true, style: k ? "right: 8px" : "left: 8px" }));
  const section = make("div", { class: "tt-section" }, canvas, values, mark, ...sides, divider);
  const stage = make("div", { class: "tt-stage" }, section);
  const bar = make("progress", { max: 1, "aria-label": "how much of the expected time is over" }), doing = make("span");
  const strip = make("div", { class: "tt-strip", hidden: true }, doing, bar, button("Cancel", () => send({ type: "cancel" })));
  const scale = make("div", { class: "tt-scale" });
  const panel = make("aside", { class: "tt-panel", "aria-label": "settings", tabindex: 0 });
  const answer = make("div", { class: "tt-answer" });
  const place = make("form", { class: "tt-place", hidden: true, onsubmit: event => {
    event.preventDefault();
    const [column, row, sample] = [...place.elements].slice(0, 3).map(input => Number(input.value));
    ask(false);
    send({ type: "explain", column, row, sample });
  } }, make("p", {}, "Choose a pixel in the picture, or by its numbers:"), ...["column", "row", "sample"].map(name => make("label", {}, name,
    make("input", { type: "number", min: 0, step: 1, value: 0, required: true }))), make("button", {}, "Explain"));
  const help = make("div", { class: "tt-help", hidden: true }, make("table", {}, ...HELP.map(([keys, what]) =>
    make("tr", {}, make("td", {}, ...keys.split(", ").flatMap((key, k) => [...(k ? [", "] : []), make("kbd", {}, key)])), make("td", {}, what)))));
  const drawer = make("aside", { class: "tt-drawer", hidden: true, "aria-label": "answers", tabindex: 0 },
    make("header", {}, make("strong", {}, ""), button("Close", () => { closeDrawer(); canvas.focus(); })), help, place, answer);
  const status = make("p", { class: "tt-numbers" }), pointed = make("p", { class: "tt-pointed" });
  const message = make("p", { class: "tt-message", role: "alert" }), spoken = make("p", { class: "tt-spoken", role: "status" });
  const pace = make("p");
  const zooms = make("select", { "aria-label": "zoom", title: "zoom into the pixels (z)", onchange: () => setZoom(Number(zooms.value)) },
    ...ZOOMS.map(z => make("option", { value: z }, z ? `${z}×` : "fit")));
  const heading = make("h1"), sceneList = make("div");
  const scenes = menu("scene", [sceneList], { title: "another shipped scene" });
  const search = make("input", { type: "search", "aria-label": "search", placeholder: "search", oninput: () => filter() });
  const list = make("div");
  const views = menu("view", [search, list], { title: "what is shown" });
  const modes = ["One picture", "Compare two", "Difference"].map((text, k) => button(text, () => send({ type: "split", mode: MODES[k] })));
  const halves = ["left", "right"].map((side, number) =>
    button(side, () => send({ type: "side", number }), { title: `the settings change the ${side} picture` }));
  const equal = make("select", { "aria-label": "what both pictures have the same number of", title: "both pictures get the same number of these",
    onchange: () => send({ type: "equal", by: equal.value }) }, ...["samples", "seconds"].map(by => make("option", { value: by }, `equal ${by}`)));
  const compare = make("div", { class: "tt-group", role: "group", "aria-label": "compare two pictures" }, ...modes);
  const compareMore = make("div", { class: "tt-group", role: "group", "aria-label": "what is compared" }, ...halves, equal);
  const explain = button("Explain a pixel", () => ask(!isAsking), { "aria-pressed": "false", title: "every number on the way to a pixel (x)" });
  const saves = menu("Save", [
    ...["png", "exr"].map(kind => button(`${kind.toUpperCase()} file`, () => { saves.close(); send({ type: "save", kind }); })),
    button("The same again, as command and Python", () => { saves.close(); send({ type: "same" }); })], { title: "save the picture (p)" }, true);
  const skip = make("a", { class: "tt-skip", href: "#", onclick: event => { event.preventDefault(); canvas.focus(); } }, "Skip to the picture");
  el.classList.add("tt-live");
  el.setAttribute("data-lm-suppress-shortcuts", "true"); // in JupyterLab, d d would delete the cell
  el.replaceChildren(skip,
    make("header", { class: "tt-bar" }, heading, scenes.whole, views.whole, compare, compareMore, make("span", { class: "tt-gap" }), explain,
      button("Reset", () => send({ type: "reset" }), { title: "reset the camera (r)" }), saves.whole,
      button("Panel", () => el.classList.toggle("tt-alone"), { title: "hide or show the panel (m)" }),
      button("?", () => showHelp(), { "aria-label": "help", title: "keys and mouse (?)" })),
    make("div", { class: "tt-main" }, stage, strip, scale, panel, drawer),
    make("footer", { class: "tt-status" }, status, pointed, message, pace, zooms), spoken);
  const context = canvas.getContext("2d", { alpha: false });

  // ── frames ──

  async function onMessage(next, bytes) {
    if (next.file) { keep(next.file, bytes); return; }
    if (bytes && bytes.byteLength) {
      const decoded = await createImageBitmap(new Blob([bytes], { type: `image/${next.kind}` }));
      bitmap?.close();
      bitmap = decoded;
    }
    if (next.id) send({ type: "ack", id: next.id });
    if (state.busy && next.busy === null) shown.panel = ""; // a choice that was given up is taken back there
    state = { ...state, ...next };
    if ("busy" in next) busySince = next.busy ? performance.now() - 1000 * next.busy.since : 0;
    showStrip();
    const isLost = Boolean(state.lost);
    el.classList.toggle("tt-lost", isLost);
    for (const part of [el.querySelector(".tt-bar"), panel]) part.inert = isLost;
    if (!bitmap || !state.offered) { setText(message, state.lost ?? ""); return; }
    if (changed("size", `${state.width} ${state.height} ${state.follows}`)) fit();
    draw();
    Object.assign(canvas.dataset, { kind: state.kind, view: state.view });
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
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    context.imageSmoothingEnabled = bitmap.width < width && !zoom;
    if (!isDouble) { context.drawImage(bitmap, 0, 0, width, height); return; }
    const cut = Math.round(border * width), share = from / width;
    if (cut > 0) context.drawImage(bitmap, 0, 0, cut * share, bitmap.height, 0, 0, cut, height);
    if (cut < width) context.drawImage(bitmap, from + cut * share, 0, from - cut * share, bitmap.height, cut, 0, width - cut, height);
  }

  // The picture has the pixels of the stage, or is enlarged by a whole number, or made smaller; zoomed, it scrolls.
  function fit() {
    const { width, height } = state, ratio = isPage ? devicePixelRatio || 1 : 1;
    if (!width) return;
    const room = stage.getBoundingClientRect(), most = Math.min(room.width * ratio / width, isPage ? room.height * ratio / height : 1);
    const factor = zoom ? zoom * ratio : state.follows || most < 1 ? most : Math.floor(most);
    [canvas.style.width, canvas.style.height] = [`${width * factor / ratio}px`, `${height * factor / ratio}px`];
    canvas.style.imageRendering = factor > 1 && (zoom || !state.follows) ? "pixelated" : "auto";
    placeParts();
  }

  function placeParts() {
    const isDouble = state.split?.mode === "sides";
    divider.hidden = !isDouble;
    divider.style.left = `${100 * border}%`;
    divider.setAttribute("aria-valuenow", Math.round(100 * border));
    sides.forEach((side, k) => {
      side.hidden = !isDouble || (k ? border > 0.97 : border < 0.03);
      if (isDouble) setText(side, [state.sides[k].view, numbersOf(state.sides[k]).short].filter(Boolean).join(" · "));
    });
    const at = state.explained;
    mark.hidden = !at;
    if (!at) return;
    const [w, h] = [state.width, state.height];
    Object.assign(mark.style, { left: `${100 * (at[0] + 0.5) / w}%`, top: `${100 * (at[1] + 0.5) / h}%`, width: `${100 / w}%`, height: `${100 / h}%` });
  }

  function keep(name, bytes) {
    const link = make("a", { href: URL.createObjectURL(new Blob([bytes])), download: name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    say(`${name} is saved`);
  }

  function say(text) { spoken.textContent = text; spokenAt = performance.now(); }

  // ── the line below the picture ──

  function numbersOf({ samples, error, is_random: isRandom, seconds }) {
    if (!isRandom) return { short: "", long: "", title: "" };
    const count = `${samples} ${samples === 1 ? "sample" : "samples"}`;
    if (!error || error.rmse === null) return { word: "", short: count, long: `${count} · measuring…`, title: "the error is not known yet" };
    const half = error.low === null ? "" : ` ± ${two((error.high - error.low) / 2)}`;
    const word = error.typical === null ? "" : WORDS.find(([most]) => error.typical <= most)[1];
    const typical = error.typical === null ? "" : ` · typical pixel ${two(error.typical)} %`;
    return { word, short: `${count} · ${three(seconds)} s · RMSE ${two(error.rmse)} %`, long: `${count} · RMSE ${two(error.rmse)} %${half}${typical}`,
      title: `RMSE, relative to the picture's mean: ${error.text}. A typical pixel: half of the picture has a smaller standard error.` };
  }

  function show(isAll) {
    const now = performance.now();
    if (!isAll && state.kind === "jpeg" && now - shownAt < 200) return; // nobody reads numbers that change faster
    shownAt = now;
    const { word, long, title } = numbersOf(state), side = state.split ? `${["left", "right"][state.split.side]}: ` : "";
    const name = `${side}${state.what === state.view ? "" : `${state.what} `}${state.view}`;
    const key = `${word} ${name} ${long}`;
    if (changed("status", key)) {
      status.replaceChildren(...(word ? [make("b", {}, word), " · "] : []), `${name}${long ? ` · ${long}` : ""}`);
      status.title = title;
    }
    setText(pace, frames.length > 2 ? `${frames.length} frames/s` : "");
    setText(message, state.lost || state.message || "");
    showScale(); showPointed(); showHistogram(); showValues(); placeParts();
    if (!isAll) return;
    if (now - spokenAt > 10000 || !spoken.textContent.startsWith(name)) say(`${name}: ${long || "complete"}`);
    showScenes();
    showViews(); showPanel(); showChart(); showSplit(); showAnswer();
  }

  function showStrip() {
    const { busy } = state, isBusy = Boolean(busy) && !state.lost;
    strip.hidden = !isBusy;
    clearTimeout(strips);
    if (!isBusy) return;
    const seconds = (performance.now() - busySince) / 1000;
    setText(doing, `${busy.text}, ` + (seconds < busy.about ? `about ${Math.max(1, Math.round(busy.about))} s` : `${Math.round(seconds)} s so far`));
    bar.value = Math.min(0.95, seconds / busy.about);
    strips = setTimeout(showStrip, 200);
  }

  function showScale() {
    const { scale: map } = state;
    if (!changed("scale", map ? `${map.low} ${map.high} ${map.text}` : "")) return;
    scale.replaceChildren(...(map ? [make("span", {}, map.low), make("i"), make("span", {}, `${map.high} ${map.text}`)] : []));
  }

  // ── the pixel under the pointer, zoom, and the numbers of pixels ──

  function showPointed() {
    const { pointed: found } = state, isHere = pointer && found?.column === pointer[0] && found.row === pointer[1];
    const side = state.split?.mode === "sides" && pointer?.[0] >= border * state.width ? 1 : 0;
    const numbers = state.split?.mode === "difference" ? `left ${found?.values[0]}, right ${found?.values[1]}` : found?.values[side];
    setText(pointed, !pointer ? "" : `Column ${pointer[0]}, row ${pointer[1]}: ` + (isHere ? `${numbers}; sees ${found.place}` : `shown as ${bytesAt(...pointer)}`));
  }

  const single = new OffscreenCanvas(1, 1).getContext("2d", { willReadFrequently: true });
  function bytesAt(column, row) { // what the page knows at once, until the program answers
    single.drawImage(canvas, -column, -row);
    return [...single.getImageData(0, 0, 1, 1).data.slice(0, 3)].join(", ");
  }

  const box = () => canvas.getBoundingClientRect();
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
    const frame = stage.getBoundingClientRect(), before = box();
    const x = pointer ? (pointer[0] + 0.5) / canvas.width : 0.5, y = pointer ? (pointer[1] + 0.5) / canvas.height : 0.5;
    const [left, top] = [before.left + x * before.width - frame.left, before.top + y * before.height - frame.top];
    zoom = value;
    zooms.value = value;
    fit();
    draw();
    [stage.scrollLeft, stage.scrollTop] = [x * canvas.offsetWidth - left, y * canvas.offsetHeight - top];
    look();
  }

  function look() { // asks for the numbers of the pixels that are in sight
    if (zoom < NUMBERS) { if (shown.look) send({ type: "look", column: 0, row: 0, columns: 0, rows: 0 }); shown.look = ""; values.replaceChildren(); return; }
    const [column, row] = [stage.scrollLeft, stage.scrollTop].map(edge => Math.floor(edge / zoom));
    const [columns, rows] = [stage.clientWidth, stage.clientHeight].map(side => Math.ceil(side / zoom) + 1);
    if (changed("look", `${column} ${row} ${columns} ${rows} ${state.id}`)) send({ type: "look", column, row, columns, rows });
  }
  let lookTimer = 0;
  stage.onscroll = () => { clearTimeout(lookTimer); lookTimer = setTimeout(look, 120); };

  function showValues() {
    const { values: found } = state;
    if (!changed("values", found && zoom >= NUMBERS ? `${zoom} ${JSON.stringify(found)}` : "")) return;
    const spans = [];
    if (found && zoom >= NUMBERS) for (let k = 0; k < found.values.length / 3; k++) {
      const [x, y] = [found.column + k % found.columns, found.row + Math.floor(k / found.columns)];
      spans.push(make("span", { style: `left: ${x * zoom}px; top: ${y * zoom + zoom / 2 - 15}px; width: ${zoom}px` },
        found.values.slice(3 * k, 3 * k + 3).map(v => v === null ? "nan" : two(v)).join("\n")));
    }
    values.replaceChildren(...spans);
  }

  // ── how often each level of red, green and blue occurs in the bytes that are shown ──

  const histogram = make("details", { ontoggle: () => showHistogram() }, make("summary", {}, "histogram"), make("div"));
  const chart = make("div"), statistics = make("details", { open: true }, make("summary", {}, "error against seconds"), chart);

  function showHistogram() {
    if (!histogram.open || !bitmap || (state.kind === "jpeg" && shown.histogram) || !changed("histogram", state.id)) return;
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
    const { split } = state, press = (buttons, chosen) => buttons.forEach((one, k) => one.setAttribute("aria-pressed", String(k === chosen)));
    if (!changed("split", JSON.stringify(split))) return;
    press(modes, MODES.indexOf(split?.mode ?? "off"));
    press(halves, split?.side);
    compareMore.hidden = !split;
    if (split) equal.value = split.equal;
    fit();
    draw();
  }

  function setBorder(value) { border = Math.max(0, Math.min(1, value)); placeParts(); draw(); }
  divider.onpointerdown = event => { divider.setPointerCapture(event.pointerId); event.stopPropagation(); };
  divider.onpointermove = event => {
    const { left, width } = box();
    if (divider.hasPointerCapture(event.pointerId)) setBorder((event.clientX - left) / width);
  };
  divider.onkeydown = event => {
    const step = { ArrowLeft: -0.02, ArrowRight: 0.02, Home: -1, End: 1 }[event.key];
    if (step) { event.preventDefault(); setBorder(border + step); }
  };

  // ── what can be chosen ──

  function showViews() {
    setText(views.opener, `${state.view} ▾`);
    if (!changed("views", JSON.stringify([state.offered, state.what, state.view]))) return;
    list.replaceChildren(...state.offered.map(({ what, names }) => make("fieldset", {}, make("legend", {}, `${what}s`),
      ...names.map(([name, label]) => button(name, () => { views.close(); set("view", name); },
        { title: label, "aria-current": String(what === state.what && name === state.view) })))));
    filter();
  }

  function showScenes() { // where the program can load another one, its name is a menu
    const canChange = state.scenes.length > 1, name = state.scene.split("/").pop();
    scenes.whole.hidden = !canChange;
    heading.classList.toggle("tt-spoken", canChange);
    setText(heading, name);
    setText(scenes.opener, `${name} ▾`);
    if (changed("scenes", JSON.stringify([state.scenes, state.scene]))) sceneList.replaceChildren(...state.scenes.map(one =>
      button(one, () => { scenes.close(); set("scene", one); }, { "aria-current": String(one === state.scene) })));
  }

  function filter() {
    const wanted = search.value.trim().toLowerCase();
    for (const group of list.children) {
      const found = [...group.querySelectorAll("button")].filter(one => {
        one.hidden = !`${one.textContent} ${one.title}`.toLowerCase().includes(wanted);
        return !one.hidden;
      });
      group.hidden = !found.length;
    }
  }

  function control({ name, label, help: title, kind, value, names, low, high, step }) {
    if (kind === "switch") return make("label", { class: "tt-switch", title }, make("input", { type: "checkbox", checked: value, "data-name": name,
      onchange: event => set(name, event.target.checked) }), label);
    if (kind === "names") return make("label", { title }, label, make("select", { "data-name": name, onchange: event => set(name, event.target.value) },
      ...names.map(one => make("option", { value: one, selected: one === value }, one.split("/").pop()))));
    const number = make("output", {}, three(value));
    return make("label", { title }, `${label} `, number, make("input", { type: "range", min: low, max: high, step, value, "data-name": name, oninput: event => {
      number.textContent = three(event.target.value);
      set(name, Number(event.target.value));
    } }));
  }

  const SECTIONS = ["estimator", "light", "camera", "display", "scene"];
  function showPanel() {
    const sliders = [...panel.querySelectorAll("input[type=range]")], active = document.activeElement;
    const key = JSON.stringify(state.controls.map(one => one.kind === "slider" ? [one.name, one.low, one.high] : one));
    if (shown.panel === key) { // only numbers are new: a slider that is not dragged takes them
      for (const { name, value } of state.controls) {
        const slider = sliders.find(one => one.dataset.name === name && one !== active);
        if (slider && Number(slider.value) !== value) { slider.value = value; slider.previousElementSibling.textContent = three(value); }
      }
      return;
    }
    if (panel.contains(active) && active.type === "range" && active.matches(":active")) return; // it is being dragged
    shown.panel = key;
    const focused = panel.contains(active) ? active.dataset.name : null;
    const isOpen = name => panel.querySelector(`details[data-section=${name}]`)?.open ?? name !== "scene";
    const parts = SECTIONS.map(name => [name, state.controls.filter(one => one.section === name).map(control)]).filter(([, found]) => found.length);
    const fitting = button("Expose to fit", () => send({ type: "expose" }), { title: "the exposure that shows the picture well" });
    panel.replaceChildren(...parts.map(([name, found]) => make("details", { open: isOpen(name), "data-section": name }, make("summary", {}, name), ...found,
      ...(name === "display" && state.controls.some(one => one.name === "exposure") ? [fitting] : []))), statistics, histogram);
    if (focused) panel.querySelector(`[data-name=${focused}]`)?.focus();
  }

  // ── the drawer: explanations, and help ──

  const title = drawer.querySelector("strong");
  function ask(isOn) {
    isAsking = isOn;
    explain.setAttribute("aria-pressed", String(isAsking));
    canvas.classList.toggle("tt-asking", isAsking);
    place.hidden = !isAsking;
    help.hidden = true;
    if (isAsking) setText(title, "Explain a pixel");
    drawer.hidden = !(isAsking || state.explanation);
  }

  function showHelp() {
    help.hidden = !help.hidden;
    setText(title, "Keys and mouse");
    drawer.hidden = help.hidden && !state.explanation;
    answer.hidden = !help.hidden;
  }

  function closeDrawer() {
    ask(false);
    help.hidden = true;
    drawer.hidden = true;
    if (state.explanation) send({ type: "close" });
  }

  function showAnswer() {
    if (!changed("answer", state.explanation)) return;
    answer.innerHTML = state.explanation;
    answer.hidden = false;
    help.hidden = true;
    drawer.hidden = !state.explanation;
    if (!state.explanation) return;
    drawer.scrollTop = 0;
    setText(title, state.explained ? `Column ${state.explained[0]}, row ${state.explained[1]}` : "The same again");
    const copy = async text => { await navigator.clipboard.writeText(text); say("It is copied."); };
    for (const text of answer.querySelectorAll("pre")) text.after(button("Copy", () => copy(text.textContent)));
    if (isCopying) copy(answer.querySelector("pre").textContent).catch(() => {}); // a browser may forbid it: the button is there
    isCopying = false;
    drawer.focus();
  }

  // ── the error against seconds ──

  function showChart() {
    if (!changed("chart", JSON.stringify(state.curves))) return;
    const curves = Object.entries(state.curves).filter(([, points]) => points.length > 1);
    statistics.hidden = !curves.length;
    if (!curves.length) return;
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
    let end = -99;
    const across = ticks(x0, x1).filter(v => { if (x(v) - end < 34) return false; end = x(v); return true; })
      .map(v => `<text x="${x(v)}" y="${h - 24}" text-anchor="middle">${Number(v.toPrecision(2))}</text>`);
    const axes = `<path d="M${left} 4V${h - bottom}H${w}" fill="none" stroke="currentColor"/><text x="${(left + w) / 2}" y="${h - 6}" `
      + `text-anchor="middle">seconds of rendering</text><text x="4" y="${h - 6}">RMSE</text>`;
    chart.innerHTML = `<svg viewBox="0 0 ${w} ${h}" role="img" aria-label="error against seconds of rendering">${down.join("")}${across.join("")}${axes}${lines.join("")}</svg>`;
  }

  // ── keys, pointer, wheel ──

  const PRESSED = { KeyR: () => send({ type: "reset" }), KeyP: () => send({ type: "save", kind: "png" }),
    KeyC: () => { isCopying = true; send({ type: "camera" }); }, KeyX: () => ask(!isAsking), KeyM: () => el.classList.toggle("tt-alone"),
    KeyF: () => setBorder(border === 1 ? 0 : border === 0 ? 0.5 : 1),
    KeyZ: () => setZoom(ZOOMS[(ZOOMS.indexOf(zoom) + 1) % ZOOMS.length]) };
  canvas.onkeydown = event => {
    if (event.key === "?") showHelp();
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === "Escape") closeDrawer();
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
    if (zoom) {
      stage.scrollBy(before.x - event.clientX, before.y - event.clientY);
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
    if (zoom) return; // it shifts the section
    event.preventDefault();
    const by = -Math.sign(event.deltaY) * Math.min(Math.abs(event.deltaY), 200) / 2000;
    if (by) move({ type: "zoom", by });
  }, { passive: false });

  // ── the size of the page, and the program ──

  let sizeTimer = 0;
  const askSize = () => {
    const { width, height } = stage.getBoundingClientRect(), ratio = devicePixelRatio || 1;
    if (isPage && state.follows && width > 16 && height > 16)
      send({ type: "size", width: Math.round(width * ratio), height: Math.round(height * ratio) });
  };
  const observer = new ResizeObserver(() => { fit(); clearTimeout(sizeTimer); sizeTimer = setTimeout(askSize, RESIZES); });
  observer.observe(stage);
  const listener = (next, bytes) => { // one after the other: a picture that is decoded quickly must not overtake an older one
    const isFirst = !state.offered;
    last = last.then(() => onMessage(next, Array.isArray(bytes) ? bytes[0] : bytes)).then(() => { if (isFirst && state.offered) askSize(); })
      .catch(error => console.error(error));
    return last;
  };
  model.on("msg:custom", listener);
  const ended = () => { state.lost = ENDED; strip.hidden = true; setText(message, ENDED); el.classList.add("tt-lost"); };
  for (const name of ["comm:close", "comm_live_update"]) model.on(name, ended); // of notebooks
  send({ type: "ack", id: 0 });
  // Who watches says so now and then; a view that is closed or hidden is not rendered for long.
  const watching = setInterval(() => { if (!document.hidden && canvas.isConnected) send({ type: "ack", id: state.id ?? 0 }); }, 4000);
  return () => {
    clearInterval(watching);
    observer.disconnect();
    for (const one of [scenes, views, saves]) one.end();
    model.off("msg:custom", listener);
    for (const timer of [pointTimer, sizeTimer, lookTimer, strips]) clearTimeout(timer);
    bitmap?.close();
    send({ type: "blur" });
  };
}

export default { render };
