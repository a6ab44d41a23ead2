// Timers of a page in the background are throttled to one a second; those of a worker are not.
setInterval(() => postMessage(0), 200);
