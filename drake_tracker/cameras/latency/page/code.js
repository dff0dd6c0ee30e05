// Shows the time of this machine as a running code, one field after the other.

const LEAST_STEP = 14; // ms; a faster screen changes a field in every second or third image only
const ROUNDS = 25, SYNC_AGAIN = 10_000, WORDS = 80;
const canvas = document.getElementById("code"), pen = canvas.getContext("2d", { alpha: false });
const layout = await (await fetch("/layout.json")).json();
let offset = null, doubt = Infinity, cell = 1, refresh = 1000 / 60, before = null, drawn = -Infinity, next = 0;
const intervals = [];

// The clock of the machine by that of the page [ms], from the quickest of many requests.
async function synchronise() {
  let best = Infinity;
  for (let round = 0; round < ROUNDS; round++) {
    const start = performance.now();
    const time = Number(await (await fetch("/time", { cache: "no-store" })).text());
    const end = performance.now();
    if (end - start < best) {
      best = end - start;
      [offset, doubt] = [time - 0.5 * (start + end), 0.5 * best];
    }
  }
  setTimeout(synchronise, SYNC_AGAIN);
}

function checksum(time) {
  let value = layout.first;
  for (let shift = layout.time_bits - 8; shift >= 0; shift -= 8) {
    value ^= Math.floor(time / 2 ** shift) & 0xff;
    for (let bit = 0; bit < 8; bit++) value = ((value << 1) & 0xff) ^ (value & 0x80 ? layout.polynomial : 0);
  }
  return value;
}

function fieldCells(time) {
  const bits = [], cells = [...layout.empty_field], check = checksum(time);
  for (let bit = layout.time_bits - 1; bit >= 0; bit--) bits.push(Math.floor(time / 2 ** bit) % 2);
  for (let bit = layout.check_bits - 1; bit >= 0; bit--) bits.push((check >> bit) & 1);
  layout.order.forEach((cell, k) => { cells[cell] = bits[k]; });
  return cells;
}

function paint([column, row], cells) {
  cells.forEach((white, k) => {
    pen.fillStyle = white ? "#ffffff" : "#000000";
    pen.fillRect((column + (k % layout.side)) * cell, (row + Math.floor(k / layout.side)) * cell, cell, cell);
  });
}

function fit() {
  const ratio = window.devicePixelRatio || 1, [columns, rows] = layout.size;
  cell = Math.max(1, Math.floor(Math.min(innerWidth * ratio / columns, (innerHeight - WORDS) * ratio / rows)));
  [canvas.width, canvas.height] = [columns * cell, rows * cell];
  [canvas.style.width, canvas.style.height] = [`${canvas.width / ratio}px`, `${canvas.height / ratio}px`];
  pen.fillStyle = "#ffffff";
  pen.fillRect(0, 0, canvas.width, canvas.height);
  layout.markers.forEach((place, number) => paint(place, layout.marker_cells[number]));
}

// A field is drawn with the time at which the screen shows it: one refresh after the page may draw.
function draw(now) {
  requestAnimationFrame(draw);
  if (before !== null) intervals.push(now - before);
  before = now;
  if (intervals.length > 120) intervals.shift();
  if (offset === null || now - drawn < LEAST_STEP) return;
  drawn = now;
  const time = Math.round(now + refresh + offset) % layout.range;
  paint(layout.fields[next], fieldCells(time));
  next = (next + 1) % layout.fields.length;
}

function report() {
  if (intervals.length < 20) return;
  const sorted = [...intervals].sort((a, b) => a - b);
  refresh = sorted[sorted.length >> 1];
  const late = sorted.filter((interval) => interval > 1.5 * refresh).length / sorted.length;
  const state = document.getElementById("state");
  state.textContent = `Screen ${(1000 / refresh).toFixed(1)} Hz, clock \u00b1${doubt.toFixed(1)} ms.`
    + (late > 0.05 ? ` ${(100 * late).toFixed(0)} % of the images of the screen are late: close other programs.` : "");
  state.className = late > 0.05 ? "bad" : "";
}

fit();
addEventListener("resize", fit);
setInterval(report, 1000);
requestAnimationFrame(draw);
await synchronise();
