// A page takes no clicks while it has no socket: they would be lost, or be done later, when nobody expects it.
// One whose socket the server has refused, as it forgot the page meanwhile, is loaded again: Socket.IO tries no
// more (https://socket.io/docs/v4/client-socket-instance/#socketactive).
(() => {
  "use strict";
  const EVERY = 40; // ms
  const look = () => {
    const connected = Boolean(window.did_handshake && window.socket?.connected);
    document.body?.classList.toggle("connected", connected);
    const app = document.getElementById("app");
    if (app && app.inert === connected) app.inert = !connected;
    if (window.socket && !window.socket.active) {
      clearInterval(looking);
      window.location.reload();
    }
  };
  const looking = setInterval(look, EVERY);
  look();
})();
