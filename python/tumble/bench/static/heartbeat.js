// Signs of life, sent by a worker: pages in the background, or busy ones, have no time of their own for them.
const EVERY = 400; // ms
const PATIENCE = 1500; // ms
setInterval(() => {
  fetch("/beat", { method: "POST", signal: AbortSignal.timeout(PATIENCE) }).catch(() => {});
}, EVERY);
