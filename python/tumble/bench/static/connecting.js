// A page takes no clicks while it has no socket: they would be lost, or be done later, when nobody expects it.
(() => {
  "use strict";
  const EVERY = 40; // ms
  const look = () => {
    const connected = Boolean(window.did_handshake && window.socket?.connected);
    document.body?.classList.toggle("connected", connected);
    const app = document.getElementById("app");
    if (app && app.inert === connected) app.inert = !connected;
  };
  look();
  setInterval(look, EVERY);
})();
