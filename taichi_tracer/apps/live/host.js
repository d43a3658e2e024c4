// The host of the page that a server of this machine serves: frames by long polling, events in batches.
import live from "./live.js";

const BATCH = 16; // milliseconds between two requests with events
const AGAIN = 1000; // milliseconds until the next try after an error
const MOST = 200; // events of a request

function makeModel() {
  const listeners = [];
  let waiting = [], timer = 0, isSending = false;

  async function flush() {
    timer = 0;
    if (isSending || !waiting.length) return;
    const events = waiting.slice(0, MOST);
    waiting = waiting.slice(MOST);
    isSending = true;
    try {
      await fetch("event", { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(events) });
    } catch { /* the next frame request says that the connection is gone */ }
    isSending = false;
    if (waiting.length && !timer) timer = setTimeout(flush, BATCH);
  }

  return {
    on(_name, listener) { listeners.push(listener); },
    off(_name, listener) { listeners.splice(listeners.indexOf(listener), 1); },
    send(event) {
      if (event.type === "ack") return;
      const last = waiting[waiting.length - 1];
      if (last && last.type === event.type && event.type === "drag" ) { last.dx += event.dx; last.dy += event.dy; }
      else waiting.push(event);
      if (!timer) timer = setTimeout(flush, BATCH);
    },
    emit(state, bytes) { for (const listener of listeners) listener(state, bytes); },
    emitLost(text) { for (const listener of listeners) listener({ lost: text }, null); },
  };
}

async function poll(model) {
  let since = 0;
  for (;;) {
    try {
      if (document.hidden) { // a page that nobody sees asks for nothing
        await new Promise(resolve => document.addEventListener("visibilitychange", resolve, { once: true }));
        continue;
      }
      const answer = await fetch(`frame?since=${since}`);
      if (answer.status === 403) { model.emitLost("Open the address that the terminal shows: it contains the token."); return; }
      if (answer.status !== 200) {
        if (answer.status !== 204) await new Promise(resolve => setTimeout(resolve, AGAIN));
        continue;
      }
      since = Number(answer.headers.get("X-Frame"));
      const data = new Uint8Array(await answer.arrayBuffer());
      const length = new DataView(data.buffer).getUint32(0, true);
      const state = JSON.parse(new TextDecoder().decode(data.subarray(4, 4 + length)));
      state.id = since;
      state.kind = answer.headers.get("X-Kind");
      model.emit(state, data.subarray(4 + length));
    } catch {
      since = 0;
      model.emitLost("The program has ended, or the connection is lost.");
      await new Promise(resolve => setTimeout(resolve, AGAIN));
    }
  }
}

const model = makeModel();
live.render({ model, el: document.getElementById("live"), files: true });
poll(model);
