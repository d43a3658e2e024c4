// The host of the page that a server of this machine serves: frames by long polling, events in batches.
import live from "./live.js";

const BATCH = 8; // milliseconds between two requests with events at least
const AGAIN = 1000; // milliseconds until the next try after an error
const MOST = 200; // events of a request
const QUEUE = 2000; // events that wait at most: a connection that is gone must not fill the memory

// The token stands behind the # of the address, which no browser sends to anybody; a reload finds it in this tab alone.
const KEY = "taichi_tracer token";
function takeToken() {
  const found = new URLSearchParams(location.hash.slice(1)).get("token");
  if (found) sessionStorage.setItem(KEY, found);
  if (found) history.replaceState(null, "", location.pathname);
  return found;
}
takeToken();
addEventListener("hashchange", () => { if (takeToken()) location.reload(); }); // the same tab gets another address
const ask = (path, options = {}) => fetch(path, { ...options,
  headers: { ...options.headers, "X-Token": sessionStorage.getItem(KEY) ?? "" } });

const pause = time => new Promise(resolve => setTimeout(resolve, time));

function makeModel() {
  const listeners = [];
  let waiting = [], timer = 0, isSending = false, sent = 0;

  async function flush() {
    timer = 0;
    if (isSending || !waiting.length) return;
    const events = waiting.slice(0, MOST);
    waiting = waiting.slice(MOST);
    isSending = true;
    sent = performance.now();
    try {
      const answer = await ask("event", { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(events) });
      if (answer.status === 429) waiting = [...events, ...waiting]; // too fast: a little later
      else if (answer.status === 400) model.emit({ message: await answer.text() });
    } catch { /* the next frame request says that the connection is gone */ }
    isSending = false;
    plan();
  }

  function plan() {
    if (waiting.length && !timer && !isSending) timer = setTimeout(flush, Math.max(0, sent + BATCH - performance.now()));
  }

  async function save(kind) {
    try {
      const answer = await ask(`picture.${kind}`);
      if (answer.ok) model.emit({ file: `picture.${kind}` }, await answer.arrayBuffer());
      else model.emit({ message: await answer.text() });
    } catch { model.emit({ lost: "The picture could not be saved: the connection is lost." }); }
  }

  const model = {
    on(name, listener) { if (name === "msg:custom") listeners.push(listener); },
    off(_name, listener) { listeners.splice(listeners.indexOf(listener), 1); },
    send(event) {
      if (event.type === "ack") return;
      if (event.type === "save") { save(event.kind); return; }
      if (waiting.length < QUEUE) waiting.push(event);
      plan();
    },
    emit(state, bytes) { return Promise.all(listeners.map(listener => listener(state, bytes))); },
  };
  return model;
}

async function poll(model) {
  let since = 0, known = 0, shown = null;
  for (;;) {
    try {
      if (document.hidden) { // a page that nobody sees asks for nothing
        await new Promise(resolve => document.addEventListener("visibilitychange", resolve, { once: true }));
        continue;
      }
      const answer = await ask(`frame?since=${since}&details=${known}`);
      if (answer.status === 403) { model.emit({ lost: "Open the address that the terminal shows: it contains the token." }); return; }
      if (answer.status !== 200) {
        if (answer.status !== 204) await pause(AGAIN);
        continue;
      }
      const data = new Uint8Array(await answer.arrayBuffer()), view = new DataView(data.buffer), text = new TextDecoder();
      const [a, b] = [view.getUint32(0, true), view.getUint32(4, true)];
      const state = JSON.parse(text.decode(data.subarray(8, 8 + a)));
      if (b) Object.assign(state, JSON.parse(text.decode(data.subarray(8 + a, 8 + a + b))));
      [since, known] = [Number(answer.headers.get("X-Frame")), Number(answer.headers.get("X-Details"))];
      await shown; // one picture is decoded while the next one is sent, and no more
      shown = model.emit({ ...state, lost: "", id: since, kind: answer.headers.get("X-Kind") }, data.subarray(8 + a + b));
    } catch {
      since = known = 0;
      model.emit({ lost: "The program has ended, or the connection is lost." });
      await pause(AGAIN);
    }
  }
}

const model = makeModel();
live.render({ model, el: document.getElementById("live") });
poll(model);
