// A picture that is watched while it is rendered: canvas, controls, chart. It runs in a page of the package's own server
// (host.js) and in a notebook (anywidget). Both give it a model with on and send. A message is what has changed of the
// state (Session.page_state), and the bytes of a picture or of a file.

const KEYS = { KeyW: "w", KeyA: "a", KeyS: "s", KeyD: "d", KeyQ: "q", KeyE: "e", KeyI: "i", KeyO: "o",
  ArrowLeft: "Left", ArrowRight: "Right", ArrowUp: "Up", ArrowDown: "Down" };
const DOES = { KeyR: "reset", KeyP: "png", KeyC: "camera", KeyX: "ask", KeyM: "panel", KeyF: "flip", KeyZ: "zoom" };
const COLOURS = ["#2f7fc1", "#d1495b", "#2f9e5b", "#9467bd", "#d9820b", "#17a2b8", "#a0664f", "#6b7f93"];
const HELP = [
  ["drag", "orbit around the point looked at"],
  ["right drag, pinch, wheel", "nearer, farther"], ["shift and drag", "shift the picture"],
  ["w a s d q e", "move the eye"], ["arrow keys", "move the point looked at"], ["i o", "nearer, farther"],
  ["r", "reset the camera"], ["z", "zoom into the pixels; dragging then shifts them; at 64× their numbers are shown"],
  ["x", "explain a pixel: choose it in the picture"], ["f", "compare: left or right alone, and both again"],
  ["p", "save the picture"], ["c", "copy the camera as options of the command line"],
  ["m", "hide or show the panel"], ["?", "this help"],
];
const MOVES = 20; // milliseconds between two events of the pointer
const POINTS = 60; // milliseconds for which the pointer rests before its pixel is asked for
const RESIZES = 250; // milliseconds after the last change of the window before the picture gets another size
const READABLE = 200; // milliseconds between two changes of the numbers while the camera moves
const ZOOMS = [0, 1, 2, 4, 8, 16, 32, 64], NUMBERS = 64; // 0 fits the picture; from NUMBERS on, pixels show their numbers
const LEVELS = 64; // of the histogram
const WORDS = [[2, "clean"], [6, "slightly grainy"], [20, "grainy"], [Infinity, "very grainy"]]; // up to so many per cent
const SECTIONS = ["estimator", "light", "camera", "display", "scene"]; // of the panel
const ENDED = "The kernel has ended: run the cell again. This is its last picture.";

// What a button with data-do does stands in render, under the same name; without a name there, it is an event.
const PAGE = `
<header class="tt-bar">
  <button class="tt-skip" data-do="close">Skip to the picture</button>
  <h1 class="tt-spoken">taichi_tracer</h1>
  <select name="scene" aria-label="scene" title="another shipped scene"></select>
  <details class="tt-menu"><summary class="tt-view" title="what is shown"></summary>
    <div tabindex="-1"><input type="search" aria-label="search" placeholder="search"><div class="tt-list"></div></div></details>
  <div class="tt-group" role="group" aria-label="compare two pictures"><button name="mode" value="off">One picture</button
    ><button name="mode" value="sides">Compare two</button><button name="mode" value="difference">Difference</button></div>
  <div class="tt-group tt-compared" role="group" aria-label="what is compared"
    ><button name="side" value="left" title="the settings change the left picture">left</button
    ><button name="side" value="right" title="the settings change the right picture">right</button
    ><select name="equal" aria-label="what both pictures have the same number of" title="both pictures get the same number of these">
      <option value="samples">equal samples</option><option value="seconds">equal seconds</option></select></div>
  <span class="tt-gap"></span>
  <button data-do="ask" title="every number on the way to a pixel (x)">Explain a pixel</button>
  <button data-do="reset" title="reset the camera (r)">Reset</button>
  <details class="tt-menu tt-end"><summary title="save the picture (p)">Save</summary>
    <div tabindex="-1"><button data-do="png">PNG file</button><button data-do="exr">EXR file</button
    ><button data-do="same">The same again, as command and Python</button></div></details>
  <button data-do="panel" title="hide or show the panel (m)">Panel</button>
  <button data-do="help" aria-label="help" title="keys and mouse (?)">?</button>
</header>
<div class="tt-main">
  <div class="tt-stage"><div class="tt-section">
    <canvas tabindex="0" role="application" aria-label="the picture: keys move the camera"></canvas>
    <div class="tt-values"></div><div class="tt-mark" hidden></div><span class="tt-side"></span><span class="tt-side"></span>
    <input class="tt-border" type="range" step="any" hidden title="drag the border; f shows one picture alone"
      aria-label="how much of the left picture is shown, in per cent">
  </div></div>
  <div class="tt-strip" hidden><span></span><progress aria-label="how much of the expected time is over"></progress
    ><button data-do="cancel">Cancel</button></div>
  <div class="tt-scale" hidden><span>0</span><i></i><span></span></div>
  <aside class="tt-panel" aria-label="settings" tabindex="0">
    ${SECTIONS.map(name => `<details ${name === "scene" ? "" : "open"}><summary>${name}</summary><div></div></details>`).join("")}
    <details class="tt-statistics" open><summary>error against seconds</summary><div></div></details>
    <details class="tt-histogram"><summary>histogram</summary><div></div></details>
  </aside>
  <aside class="tt-drawer" hidden aria-label="answers" tabindex="0">
    <header><strong></strong><button data-do="close">Close</button></header>
    <table class="tt-help" hidden>${HELP.map(([keys, what]) => `<tr><td><kbd>${keys}</kbd></td><td>${what}</td></tr>`).join("")}</table>
    <form class="tt-place" hidden><p>Choose a pixel in the picture, or by its numbers:</p>
      ${["column", "row", "sample"].map(name => `<label>${name}<input type="number" min="0" value="0" required></label>`).join("")}
      <button>Explain</button></form>
    <div class="tt-answer" hidden></div>
  </aside>
</div>
<footer class="tt-status"><p class="tt-numbers"></p><p class="tt-pointed"></p><p class="tt-message" role="alert"></p
  ><p class="tt-pace"></p><select class="tt-zoom" aria-label="zoom" title="zoom into the pixels (z)"></select></footer>
<p class="tt-spoken" role="status"></p>`;

function make(name, properties, ...children) {
  const element = Object.assign(document.createElement(name), properties);
  element.append(...children);
  return element;
}

const options = names => names.map(name => new Option(name.split("/").pop(), name));
// Round numbers from 1e-8 to 1e6: many, fewer, and few.
const ROUND = [[1, 1.5, 2, 3, 5, 7], [1, 2, 5], [1]].map(of => [...Array(15).keys()].flatMap(k => of.map(m => m * 10 ** (k - 8))));
const rounded = (value, digits) => String(Number(Number(value).toPrecision(digits)));
const three = value => rounded(value, 3), two = value => rounded(value, 2);
const setText = (element, text) => { if (element.textContent !== text) element.textContent = text; };

function render({ model, el }) {
  let state = {}, bitmap = null, frames = [], spokenAt = 0, numbersAt = 0, busySince = 0, last = Promise.resolve();
  let isCopying = false, pointer = null, zoom = 0, border = 0.5, controlsKey = "", lookKey = "", motion = null;
  let pointTimer = 0, lookTimer = 0, sizeTimer = 0, stripTimer = 0;
  const isPage = Boolean(el.closest(".tt-page"));
  el.classList.add("tt-live");
  el.setAttribute("data-lm-suppress-shortcuts", "true"); // in JupyterLab, d d would delete the cell
  el.innerHTML = PAGE;
  const part = name => el.querySelector(`.tt-${name}`), all = selector => [...el.querySelectorAll(selector)];
  const [stage, values, mark, divider, strip, scale] = ["stage", "values", "mark", "border", "strip", "scale"].map(part);
  const [panel, statistics, histogram, drawer] = ["panel", "statistics", "histogram", "drawer"].map(part);
  const [help, place, answer, list, zooms] = ["help", "place", "answer", "list", "zoom"].map(part);
  const [status, pointed, message, spoken] = [part("numbers"), part("pointed"), part("message"), el.lastElementChild];
  const scenes = el.querySelector("[name=scene]"), equal = el.querySelector("[name=equal]"), search = el.querySelector("[type=search]");
  const canvas = el.querySelector("canvas"), context = canvas.getContext("2d", { alpha: false });
  const box = () => canvas.getBoundingClientRect();
  zooms.append(...ZOOMS.map(factor => new Option(factor ? `${factor}×` : "fit", factor)));

  // ── what buttons and keys do, and events to the program ──

  const send = event => model.send(event);
  const set = (name, value) => send({ type: "set", name, value });
  const compare = ({ name, value }) => send({ type: "compare", ...state.compare, [name]: value });
  const save = kind => send({ type: "save", kind });
  const actions = {
    flip: () => setBorder(border === 1 ? 0 : border === 0 ? 0.5 : 1),
    png: () => save("png"), exr: () => save("exr"), camera: () => { isCopying = true; send({ type: "same" }); },
    zoom: () => setZoom(ZOOMS[(ZOOMS.indexOf(zoom) + 1) % ZOOMS.length]), panel: () => el.classList.toggle("tt-alone"),
    ask: () => openDrawer(place.hidden && place, "Explain a pixel"), help: () => openDrawer(help.hidden && help, "Keys and mouse"),
    close: () => { openDrawer(null); canvas.focus(); },
  };
  const act = name => name in actions ? actions[name]() : send({ type: name });
  el.onclick = ({ target }) => {
    if (target.dataset.do) act(target.dataset.do);
    if (target.matches(".tt-group button")) compare(target);
    if (target.name === "view") set("view", target.value);
    const menu = target.closest(".tt-menu");
    if (menu && target.localName === "button") canvas.focus();
  };
  el.onkeydown = event => {
    if (event.key === "Escape") act("close");
  };
  for (const menu of all(".tt-menu")) {
    menu.ontoggle = () => { if (menu.open) menu.querySelector("input, button").focus(); };
    menu.onfocusout = ({ relatedTarget }) => { if (!menu.contains(relatedTarget)) menu.open = false; };
  }
  const move = change => { // movements of the pointer come faster than pictures: they are added up
    if (!motion) setTimeout(() => { send(motion); motion = null; }, MOVES);
    motion ??= { type: "move", orbit_x: 0, orbit_y: 0, pan_x: 0, pan_y: 0, nearer: 0 };
    for (const name of Object.keys(change)) motion[name] += change[name];
  };
  const acknowledge = id => { if (!document.hidden && canvas.isConnected) send({ type: "ack", id }); };

  // ── frames ──

  async function onMessage(next, bytes) {
    if (next.file) { keep(next.file, bytes); return; }
    if (bytes?.byteLength) {
      const decoded = await createImageBitmap(new Blob([bytes], { type: `image/${next.kind}` })), now = performance.now();
      bitmap?.close();
      bitmap = decoded;
      frames = [...frames.filter(time => now - time < 1000), now];
    }
    if (next.id) acknowledge(next.id);
    state = { ...state, ...next };
    el.classList.toggle("tt-lost", Boolean(state.lost));
    for (const one of [part("bar"), panel]) one.inert = Boolean(state.lost);
    setText(message, state.lost || state.message || "");
    if (bitmap && state.sides) show(next);
  }

  function show(next) {
    const isNew = (...names) => names.some(name => name in next);
    if (isNew("compare")) showCompare();
    if (isNew("width", "height", "follows", "compare")) { fit(); look(); }
    draw();
    Object.assign(canvas.dataset, { kind: state.kind, view: state.view });
    if (isNew("busy")) busySince = performance.now();
    if (isNew("busy", "lost")) showStrip();
    if (isNew("scene", "scenes")) showScenes();
    if (isNew("offered", "view")) showViews();
    if (isNew("explanation")) showAnswer();
    if (isNew("curves")) showChart();
    if (isNew("values")) showValues();
    showPointed();
    const now = performance.now();
    if (state.kind === "jpeg" && now - numbersAt < READABLE) return; // nobody reads numbers that change faster
    numbersAt = now;
    showNumbers();
    showPanel();
    showHistogram();
    placeParts();
  }

  // A picture that moves may be smaller than the canvas; of two halves, both are in it, one beside the other.
  function draw() {
    if (!bitmap || !state.width) return;
    const { width, height } = state, isDouble = state.compare.mode === "sides", from = bitmap.width / (isDouble ? 2 : 1);
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
    const isDouble = state.compare.mode === "sides", { explained: at, width, height } = state;
    divider.hidden = !isDouble;
    divider.value = 100 * border;
    all(".tt-side").forEach((side, k) => {
      side.hidden = !isDouble || (k ? border > 0.97 : border < 0.03);
      if (isDouble) setText(side, [state.sides[k].view, numbersOf(state.sides[k]).short].filter(Boolean).join(" · "));
    });
    mark.hidden = !at;
    if (at) Object.assign(mark.style, { left: `${100 * (at[0] + 0.5) / width}%`, top: `${100 * (at[1] + 0.5) / height}%`,
      width: `${100 / width}%`, height: `${100 / height}%` });
  }

  function setBorder(value) { border = value; placeParts(); draw(); }
  divider.oninput = () => setBorder(divider.value / 100);

  function keep(name, bytes) {
    const link = make("a", { href: URL.createObjectURL(new Blob([bytes])), download: name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    say(`${name} is saved`);
  }

  function say(text) { spoken.textContent = text; spokenAt = performance.now(); }

  // ── the line below the picture ──

  function numbersOf({ samples, error, seconds }) {
    if (!samples) return { word: "", short: "", long: "", title: "" };
    const count = `${samples} ${samples === 1 ? "sample" : "samples"}`;
    if (!error || error.rmse === null) return { word: "", short: count, long: ` · ${count} · measuring…`, title: "the error is not known yet" };
    const half = error.low === null ? "" : ` ± ${two((error.high - error.low) / 2)}`;
    const word = error.typical === null ? "" : WORDS.find(([most]) => error.typical <= most)[1];
    const typical = error.typical === null ? "" : ` · typical pixel ${two(error.typical)} %`;
    return { word, short: `${count} · ${three(seconds)} s · RMSE ${two(error.rmse)} %`, long: ` · ${count} · RMSE ${two(error.rmse)} %${half}${typical}`,
      title: `RMSE, relative to the picture's mean: ${error.text}. A typical pixel: half of the picture has a smaller standard error.` };
  }

  function showNumbers() {
    const { side, mode } = state.compare, { word, long, title } = numbersOf(state.sides[side === "right" ? 1 : 0]);
    const name = `${mode === "off" ? "" : `${side}: `}${state.what === state.view ? "" : `${state.what} `}${state.view}`;
    status.replaceChildren(...(word ? [make("b", {}, word), " · "] : []), name + long);
    status.title = title;
    setText(part("pace"), frames.length > 2 ? `${frames.length} frames/s` : "");
    if (performance.now() - spokenAt > 10000 || !spoken.textContent.startsWith(name)) say(`${name}: ${long || "complete"}`);
    scale.hidden = !state.scale;
    if (state.scale) setText(scale.lastChild, `${state.scale.high} (${state.scale.text})`);
  }

  function showStrip() {
    const { busy } = state;
    clearTimeout(stripTimer);
    strip.hidden = !busy || Boolean(state.lost);
    if (strip.hidden) return;
    const seconds = (performance.now() - busySince) / 1000, [doing, bar] = strip.children;
    setText(doing, `${busy.text}, ` + (seconds < busy.about ? `about ${Math.max(1, Math.round(busy.about))} s` : `${Math.round(seconds)} s so far`));
    bar.value = Math.min(0.95, seconds / busy.about);
    stripTimer = setTimeout(showStrip, 200);
  }

  // ── the pixel under the pointer, zoom, and the numbers of pixels ──

  function showPointed() {
    const { pointed: found, compare: { mode } } = state, isHere = pointer && found?.column === pointer[0] && found.row === pointer[1];
    const side = mode === "sides" && pointer?.[0] >= border * state.width ? 1 : 0;
    const numbers = mode === "difference" ? `left ${found?.values[0]}, right ${found?.values[1]}` : found?.values[side];
    setText(pointed, !pointer ? "" : `Column ${pointer[0]}, row ${pointer[1]}: ` + (isHere ? `${numbers}; sees ${found.place}` : `shown as ${bytesAt(...pointer)}`));
  }

  const single = new OffscreenCanvas(1, 1).getContext("2d", { willReadFrequently: true });
  function bytesAt(column, row) { // what the page knows at once, until the program answers
    single.drawImage(canvas, -column, -row);
    return [...single.getImageData(0, 0, 1, 1).data.slice(0, 3)].join(", ");
  }

  const pixelAt = event => {
    const { left, top, width, height } = box(), inside = (share, size) => Math.max(0, Math.min(size - 1, Math.floor(share * size)));
    return [inside((event.clientX - left) / width, canvas.width), inside((event.clientY - top) / height, canvas.height)];
  };

  function pointAt(place) {
    clearTimeout(pointTimer);
    pointer = place;
    if (place) pointTimer = setTimeout(() => send({ type: "point", column: place[0], row: place[1] }), POINTS);
    if (bitmap) showPointed();
  }

  // The pixel that was under the pointer, or in the middle, stays where it is.
  function setZoom(value) {
    const frame = stage.getBoundingClientRect(), before = box();
    const x = pointer ? (pointer[0] + 0.5) / canvas.width : 0.5, y = pointer ? (pointer[1] + 0.5) / canvas.height : 0.5;
    const [left, top] = [before.left + x * before.width - frame.left, before.top + y * before.height - frame.top];
    zoom = value;
    zooms.value = value;
    values.hidden = zoom < NUMBERS;
    fit();
    draw();
    [stage.scrollLeft, stage.scrollTop] = [x * canvas.offsetWidth - left, y * canvas.offsetHeight - top];
    look();
  }
  zooms.onchange = () => setZoom(Number(zooms.value));

  function look() { // asks for the numbers of the pixels that are in sight
    const places = zoom < NUMBERS ? [0, 0, 0, 0] : [...[stage.scrollLeft, stage.scrollTop].map(edge => Math.floor(edge / zoom)),
      ...[stage.clientWidth, stage.clientHeight].map(side => Math.ceil(side / zoom) + 1)];
    if (lookKey === String(places)) return;
    lookKey = String(places);
    const [column, row, columns, rows] = places;
    send({ type: "look", column, row, columns, rows });
  }
  stage.onscroll = () => { clearTimeout(lookTimer); lookTimer = setTimeout(look, 120); };

  function showValues() {
    const { column, row, columns, values: found } = state.values ?? { values: [] }, spans = [];
    for (let k = 0; k < found.length / 3; k++) {
      const [x, y] = [column + k % columns, row + Math.floor(k / columns)];
      spans.push(make("span", { style: `left: ${x * NUMBERS}px; top: ${y * NUMBERS + NUMBERS / 2 - 15}px; width: ${NUMBERS}px` },
        found.slice(3 * k, 3 * k + 3).map(v => v === null ? "nan" : two(v)).join("\n")));
    }
    values.replaceChildren(...spans);
  }

  // ── what can be chosen ──

  function showCompare() {
    for (const one of all(".tt-group button")) one.ariaPressed = state.compare[one.name] === one.value;
    part("compared").hidden = state.compare.mode === "off";
    equal.value = state.compare.equal;
  }
  equal.onchange = () => compare(equal);

  function showScenes() {
    scenes.replaceChildren(...options([...new Set([...state.scenes, state.scene])]));
    scenes.value = state.scene;
    scenes.disabled = scenes.length < 2;
  }
  scenes.onchange = () => set("scene", scenes.value);

  function showViews() {
    setText(part("view"), state.view);
    list.replaceChildren(...state.offered.map(({ what, names }) => make("fieldset", {}, make("legend", {}, `${what}s`),
      ...names.map(([name, label]) => make("button", { name: "view", value: name, title: label, ariaCurrent: name === state.view }, name)))));
    search.oninput();
  }
  search.oninput = () => {
    const wanted = search.value.trim().toLowerCase();
    for (const one of list.querySelectorAll("button")) one.hidden = !`${one.value} ${one.title}`.toLowerCase().includes(wanted);
    for (const group of list.children) group.hidden = !group.querySelector("button:not([hidden])");
  };

  function control({ name, label, help: title, value, names, low, high, step }) {
    if (names) return make("label", { title }, label, make("select", { name }, ...options(names)));
    if (typeof value === "boolean") return make("label", { title, className: "tt-switch" }, make("input", { name, type: "checkbox" }), label);
    return make("label", { title }, `${label} `, make("output"), make("input", { name, type: "range", min: low, max: high, step }));
  }
  const showNumber = slider => setText(slider.previousElementSibling, three(slider.value));

  panel.oninput = ({ target }) => {
    if (target.type === "range") showNumber(target);
    set(target.name, { range: target.valueAsNumber, checkbox: target.checked }[target.type] ?? target.value);
  };

  function showPanel() {
    const { controls } = state, key = JSON.stringify(controls.map(one => ({ ...one, value: null })));
    if (panel.querySelector("input:active") || (state.busy && key === controlsKey)) return; // what is dragged or chosen stays
    if (key !== controlsKey) {
      const focused = panel.contains(document.activeElement) && document.activeElement.name;
      SECTIONS.forEach((name, k) => {
        const found = controls.filter(one => one.section === name).map(control);
        panel.children[k].hidden = !found.length;
        panel.children[k].lastChild.replaceChildren(...found);
      });
      controlsKey = key;
      panel.querySelector("[name=exposure]")?.parentElement.after(
        make("button", { title: "the exposure that shows the picture well", onclick: () => act("expose") }, "Expose to fit"));
      if (focused) panel.querySelector(`[name=${focused}]`)?.focus();
    }
    for (const { name, value } of controls) {
      const one = panel.querySelector(`[name=${name}]`);
      if (one.matches("[type=range]:focus")) continue;
      [one.value, one.checked] = [value, value];
      if (one.type === "range") showNumber(one);
    }
    scenes.value = state.scene;
  }

  // ── the drawer: help, the place of a pixel, and answers ──

  function openDrawer(shown, title) { // of its three parts, one or none
    if (shown !== answer && state.explanation) send({ type: "close" });
    for (const one of [help, place, answer]) one.hidden = one !== shown;
    drawer.hidden = !shown;
    drawer.scrollTop = 0;
    setText(drawer.querySelector("strong"), title);
  }

  place.onsubmit = event => {
    event.preventDefault();
    const [column, row, sample] = [...place.elements].map(input => Number(input.value));
    act("close");
    send({ type: "explain", column, row, sample });
  };

  function showAnswer() {
    if (!state.explanation) { if (!answer.hidden) openDrawer(null); return; }
    answer.innerHTML = state.explanation;
    openDrawer(answer, state.explained ? `Column ${state.explained[0]}, row ${state.explained[1]}` : "The same again");
    const copy = async text => { await navigator.clipboard.writeText(text); say("It is copied."); };
    const texts = [...answer.querySelectorAll("pre")];
    for (const text of texts) text.after(make("button", { onclick: () => copy(text.textContent) }, "Copy"));
    if (isCopying) copy(texts[1].textContent).catch(() => {}); // a browser may forbid it: the button is there
    isCopying = false;
    drawer.focus();
  }

  // ── how often each level of red, green and blue occurs in the bytes that are shown; the error against seconds ──

  histogram.ontoggle = showHistogram;
  function showHistogram() {
    if (!histogram.open || !bitmap || state.kind === "jpeg") return;
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
    const lines = counts.map((of, k) => `<polyline class="tt-level${k}" points="`
      + of.map((n, i) => `${i * w / (LEVELS - 1)},${h - 2 - (h - 6) * Math.sqrt(n / most)}`).join(" ") + '"/>');
    histogram.lastChild.innerHTML = `<svg viewBox="0 0 ${w} ${h}" role="img" aria-label="histogram of red, green and blue">${lines.join("")}</svg>`
      + `<p>0 to 255; heights are square roots. Black: ${share(dark)} of the pixels; a channel at 255: ${share(white)}.</p>`;
  }

  function showChart() {
    const curves = Object.entries(state.curves).filter(([, points]) => points.length > 1);
    statistics.hidden = !curves.length;
    if (!curves.length) return;
    const [w, h, left, bottom] = [280, 190, 44, 40], points = curves.flatMap(([, of]) => of);
    const axis = (k, from, to) => { // logarithmic
      const logs = points.map(point => Math.log(point[k])), low = Math.min(...logs) - 0.2, high = Math.max(...logs) + 0.2;
      const ticks = ROUND.map(of => of.filter(v => Math.log(v) > low && Math.log(v) < high)).find(of => of.length < 7);
      return { at: value => from + (to - from) * (Math.log(value) - low) / (high - low), ticks };
    };
    const x = axis(0, left, w - 6), y = axis(1, h - bottom, 8);
    const lines = curves.map(([name, of], i) => `<g style="--colour: ${COLOURS[i % COLOURS.length]}">`
      + `<polyline points="${of.map(([s, e]) => `${x.at(s)},${y.at(e)}`).join(" ")}"/>`
      + of.map(([s, e]) => `<circle cx="${x.at(s)}" cy="${y.at(e)}" r="2.5"><title>${name}: ${three(100 * e)} % after ${three(s)} s</title></circle>`).join("")
      + `<text x="${w - 4}" y="${14 + 14 * i}" text-anchor="end">${name}</text></g>`);
    const down = y.ticks.map(v => `<path d="M${left} ${y.at(v)}H${w}" class="tt-grid"/><text x="${left - 4}" y="${y.at(v) + 4}" text-anchor="end">${two(100 * v)} %</text>`);
    const across = x.ticks.map(v => `<text x="${x.at(v)}" y="${h - 24}" text-anchor="middle">${two(v)}</text>`);
    statistics.lastChild.innerHTML = `<svg viewBox="0 0 ${w} ${h}" role="img" aria-label="error against seconds of rendering">${down.join("")}${across.join("")}`
      + `<path d="M${left} 4V${h - bottom}H${w}" class="tt-axes"/><text x="${(left + w) / 2}" y="${h - 6}" text-anchor="middle">seconds of rendering</text>`
      + `<text x="4" y="${h - 6}">RMSE</text>${lines.join("")}</svg>`;
  }

  // ── keys, pointer, wheel ──

  canvas.onkeydown = event => {
    if (event.key === "?") act("help");
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const key = KEYS[event.code];
    if (key) event.preventDefault();
    if (event.repeat) return;
    if (event.code in DOES) act(DOES[event.code]);
    if (key) send({ type: "key", key, down: true });
  };
  canvas.onkeyup = event => { const key = KEYS[event.code]; if (key) send({ type: "key", key, down: false }); };
  canvas.onblur = () => send({ type: "blur" });
  const pointers = new Map();
  const spread = () => { const [a, b] = [...pointers.values()]; return Math.hypot(a.x - b.x, a.y - b.y); };
  canvas.onpointerdown = event => {
    event.preventDefault();
    canvas.focus();
    if (!place.hidden) {
      [place.elements[0].value, place.elements[1].value] = pixelAt(event);
      place.requestSubmit();
      return;
    }
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    canvas.setPointerCapture(event.pointerId);
  };
  canvas.onpointermove = event => {
    const before = pointers.get(event.pointerId), apart = pointers.size === 2 ? spread() : 0;
    if (!before) { pointAt(pixelAt(event)); return; }
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    const { width, height } = box(), x = (event.clientX - before.x) / width, y = (before.y - event.clientY) / height;
    if (zoom) stage.scrollBy(before.x - event.clientX, before.y - event.clientY);
    else if (pointers.size === 2) move({ nearer: (spread() - apart) / height });
    else if (event.buttons & 2) move({ nearer: y });
    else if (event.shiftKey) move({ pan_x: x, pan_y: y });
    else move({ orbit_x: x, orbit_y: y });
  };
  canvas.onpointerup = canvas.onpointercancel = event => pointers.delete(event.pointerId);
  canvas.onpointerleave = () => pointAt(null);
  canvas.oncontextmenu = event => event.preventDefault();
  canvas.addEventListener("wheel", event => {
    if (zoom) return; // it shifts the section
    event.preventDefault();
    move({ nearer: -Math.sign(event.deltaY) * Math.min(Math.abs(event.deltaY), 200) / 2000 });
  }, { passive: false });

  // ── the size of the page, and the program ──

  const askSize = () => {
    const { width, height } = stage.getBoundingClientRect(), ratio = devicePixelRatio || 1;
    if (isPage && state.follows && width > 16 && height > 16)
      send({ type: "size", width: Math.round(width * ratio), height: Math.round(height * ratio) });
  };
  const observer = new ResizeObserver(() => { fit(); clearTimeout(sizeTimer); sizeTimer = setTimeout(askSize, RESIZES); });
  observer.observe(stage);
  const listener = (next, bytes) => { // one after the other: a picture that is decoded quickly must not overtake an older one
    const isFirst = !state.sides;
    last = last.then(() => onMessage(next, Array.isArray(bytes) ? bytes[0] : bytes)).then(() => { if (isFirst && state.sides) askSize(); })
      .catch(error => console.error(error));
    return last;
  };
  model.on("msg:custom", listener);
  for (const name of ["comm:close", "comm_live_update"]) model.on(name, () => onMessage({ lost: ENDED })); // of notebooks
  acknowledge(0);
  const watching = setInterval(() => acknowledge(state.id ?? 0), 4000); // a page that was hidden, and so took no more pictures
  return () => {
    clearInterval(watching);
    observer.disconnect();
    model.off("msg:custom", listener);
    for (const timer of [pointTimer, sizeTimer, lookTimer, stripTimer]) clearTimeout(timer);
    bitmap?.close();
    send({ type: "blur" });
  };
}

export default { render };
