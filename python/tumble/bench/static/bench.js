// Keys, scanner, tones and signs of life of the bench page.
(() => {
  "use strict";
  const SCAN_GAP = 60; // ms between two letters of a scanner, at most; fingers are slower
  const FEWEST_LETTERS = 3;
  const INTERACTIVE = "button, a, input, select, textarea, summary, [role=button], [role=tab]";

  const emit = (name, value) => {
    if (window.did_handshake) emitEvent(name, value ?? null);
  };
  // Never kept for later: a page without a socket does nothing, and what is shown by then may be something else.
  const act = (name, value) => {
    if (window.socket?.connected) emit(name, [Number(document.getElementById("keys").dataset.shown), value ?? null]);
  };

  // The time at which a message was sent: one that comes late is not acted on.
  const stamping = setInterval(() => {
    const { socket } = window;
    if (!socket) return;
    clearInterval(stamping);
    const send = socket.emit;
    socket.emit = function (name, message, ...others) {
      const stamped = message && typeof message === "object" ? { ...message, sent: performance.now() } : message;
      return send.call(this, name, stamped, ...others);
    };
  }, 40);

  new Worker("/bench/heartbeat.js");

  let typed = "";
  let typedAt = 0;

  const isScanned = () => typed.length >= FEWEST_LETTERS;

  const scanned = (event) => {
    // The time of the event itself: the page may be busy when the first letter comes.
    if (event.timeStamp - typedAt > SCAN_GAP) typed = "";
    typedAt = event.timeStamp;
    if (event.key.length === 1) {
      typed += event.key;
      return false;
    }
    if (event.key !== "Enter" || !isScanned()) return false;
    act("bench_scan", typed);
    typed = "";
    return true;
  };

  const pedal = () => document.body.dataset.pedal || "";

  document.addEventListener(
    "keydown",
    (event) => {
      if (event.ctrlKey || event.altKey || event.metaKey || event.isComposing) return;
      if (event.key === "Escape") {
        emit("bench_stop");
        return;
      }
      if (event.repeat) return;
      if (event.key === pedal()) {
        event.preventDefault();
        act("bench_go");
        return;
      }
      const inField = event.target.closest("input, select, textarea");
      if (!inField && scanned(event)) {
        event.preventDefault();
        return;
      }
      if (document.querySelector("dialog[open], .q-dialog")) return;
      if ((event.key === " " || event.key === "Enter") && !event.target.closest(INTERACTIVE)) {
        event.preventDefault();
        // A scanner ends with Enter, and its letters may hold a space.
        if (event.key === " " && event.timeStamp - typedAt < SCAN_GAP && typed.length > 1) return;
        act("bench_go");
      }
    },
    true,
  );

  const TONES = {
    held: [[880, 0, 0.12]],
    "part done": [[880, 0, 0.1], [1175, 0.12, 0.14]],
    done: [[659, 0, 0.16], [880, 0.17, 0.16], [1319, 0.34, 0.4]],
    failed: [[330, 0, 0.3], [220, 0.32, 0.55]],
    warning: [[440, 0, 0.2], [440, 0.28, 0.2]],
  };
  let sound = null;
  const wake = () => {
    sound ??= new AudioContext();
    sound.resume();
  };
  // A little later: to open the sound takes longer than a scanner waits between two letters.
  const wakeLater = () => setTimeout(wake, 300);
  for (const name of ["pointerdown", "keydown"]) document.addEventListener(name, wakeLater, { once: true });

  window.benchTones = [];
  window.benchTone = (name) => {
    window.benchTones.push(name);
    if (localStorage.getItem("bench-mute") === "1" || !sound) return;
    for (const [pitch, after, length] of TONES[name] ?? []) {
      const from = sound.currentTime + after;
      const loudness = new GainNode(sound, { gain: 0 });
      loudness.gain.setValueAtTime(0, from);
      loudness.gain.linearRampToValueAtTime(0.25, from + 0.015);
      loudness.gain.exponentialRampToValueAtTime(0.001, from + length);
      const voice = new OscillatorNode(sound, { type: "triangle", frequency: pitch });
      voice.connect(loudness).connect(sound.destination);
      voice.start(from);
      voice.stop(from + length + 0.05);
    }
  };
  window.benchMute = () => {
    const mute = localStorage.getItem("bench-mute") === "1" ? "0" : "1";
    localStorage.setItem("bench-mute", mute);
    return mute === "1";
  };
})();
