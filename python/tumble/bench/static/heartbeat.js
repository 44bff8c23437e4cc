// Ticks in a worker: pages in the background have their own timers slowed down to one tick a minute.
setInterval(() => postMessage(null), 400);
