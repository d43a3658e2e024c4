// The host of the page that a server of this machine serves: one WebSocket for frames and events.
import live from "./live.js";

const WAIT = 5000; // milliseconds until the next try after the connection is lost
const REFUSED = 1008; // the code with which the server closes a connection that has shown no token
const AGAIN = "The program has ended, or the connection is lost. If it runs again, open the address that it prints.";

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

let socket = null, emit = null; // emit takes a message of the server to the page
const model = {
  on(name, listener) { if (name === "msg:custom") emit = listener; },
  send(event) {
    if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(event));
  },
};

function connect() {
  socket = new WebSocket(`ws://${location.host}/socket`);
  socket.binaryType = "arraybuffer";
  socket.onopen = () => socket.send(sessionStorage.getItem(KEY) ?? "");
  socket.onmessage = ({ data }) => {
    const length = new DataView(data).getUint32(0, true);
    const state = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
    emit(state, new Uint8Array(data, 4 + length));
  };
  socket.onclose = ({ code, reason }) => {
    emit({ lost: reason || AGAIN });
    if (code !== REFUSED) setTimeout(connect, WAIT);
  };
}
live.render({ model, el: document.getElementById("live") });
connect();
