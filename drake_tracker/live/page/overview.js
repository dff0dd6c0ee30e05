// The belt from above: parts with their identities, the hand, the cells, and the queue of the parts beside it.

const GROUND = "#12161a", BELT = "#23282e", WINDOW = "#2c3a33", CELL = "#3a434d", INK = "#f2f4f6", DIM = "#6b747f";
const NEXT = "#4cc2ff", SEEN = "#f2f4f6", CROWDED = "#e0703a";
const ROWS = 6; // parts that the table lists

export class Overview {
  constructor(element, facts) {
    this.facts = facts;
    this.values = null;
    this.canvas = element.querySelector("canvas");
    this.rows = element.querySelector("tbody");
    this.counts = ["per-minute", "placed", "failed"].map((id) => document.getElementById(id));
    element.hidden = false;
    new ResizeObserver(() => this.draw()).observe(this.canvas);
  }

  take(values) { this.values = values; }

  draw() {
    const ratio = window.devicePixelRatio || 1;
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    [this.canvas.width, this.canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
    const { x: [xLow, xHigh], y: [yLow, yHigh], belt, window: picking, end, cells, cell } = this.facts;
    const scale = Math.min(width / (yHigh - yLow), height / (xHigh - xLow));
    const left = 0.5 * (width - scale * (yHigh - yLow)), top = 0.5 * (height - scale * (xHigh - xLow));
    // The belt moves along +y, to the right; x points up, away from the arm.
    this.at = (x, y) => [left + scale * (y - yLow), top + scale * (xHigh - x)];
    const pen = this.pen = this.canvas.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    this.box([xLow, xHigh], [yLow, yHigh], GROUND);
    this.box(belt, [yLow, yHigh], BELT);
    this.box(belt, picking, WINDOW);
    this.box(belt, [end - 0.002, end + 0.002], DIM);
    for (const [x, y] of cells) {
      this.polygon([[x - cell / 2, y - cell / 2], [x + cell / 2, y - cell / 2], [x + cell / 2, y + cell / 2], [x - cell / 2, y + cell / 2]]);
      this.stroke(CELL);
    }
    if (!this.values) return;
    this.parts();
    this.hand();
    this.queue();
  }

  parts() {
    const { outlines, parts, min_clear: room, y: [low, high] } = this.facts, pen = this.pen;
    for (const [index, x, y, yaw] of this.values.true) {
      if (y < low || y > high) continue;
      const [kind, colour] = parts[index];
      this.polygon(placed(outlines[kind], x, y, yaw));
      pen.fillStyle = colour;
      pen.globalAlpha = 0.85;
      pen.fill();
      pen.globalAlpha = 1;
    }
    for (const [number, kind, x, y, yaw, clear] of this.values.seen) {
      const next = number === this.values.order;
      this.polygon(placed(outlines[kind], x, y, yaw));
      this.stroke(next ? NEXT : clear < room ? CROWDED : SEEN, next ? 3 : 1.4);
      const [u, v] = this.at(x, y);
      pen.font = `${next ? "700" : "600"} 13px system-ui, "DejaVu Sans", sans-serif`;
      pen.textAlign = "center";
      pen.fillStyle = next ? NEXT : INK;
      pen.fillText(number, u, v - 0.5 * Math.abs(this.at(0.08, 0)[1] - this.at(0, 0)[1]));
    }
  }

  hand() {
    const [x, y, yaw, width] = this.values.hand, [along, open] = [0.02, 0.5 * width];
    for (const side of [-1, 1]) {
      const finger = [[-along, side * open], [along, side * open], [along, side * (open + 0.012)], [-along, side * (open + 0.012)]];
      this.polygon(placed(finger, x, y, yaw));
      this.pen.fillStyle = INK;
      this.pen.fill();
    }
    const { order, seen, cell } = this.values, part = seen.find(([number]) => number === order);
    if (part) this.line([x, y], [part[2], part[3]]);
    if (part && cell !== null) this.line([part[2], part[3]], this.facts.cells[cell]);
  }

  queue() {
    const { seen, order, per_minute: rate, placed: count, failed } = this.values;
    const { names, window: [, last], min_clear: room } = this.facts;
    [rate.toFixed(1), count, failed].forEach((words, k) => { this.counts[k].textContent = words; });
    const waiting = seen.filter(([, , , y]) => y <= last).sort((a, b) => b[3] - a[3]);
    waiting.sort((a, b) => (b[0] === order) - (a[0] === order));
    this.rows.replaceChildren(...waiting.slice(0, ROWS).map(([number, kind, , y, , clear]) => {
      const row = document.createElement("tr"), next = number === order;
      const state = next ? "ordered" : clear < room ? "no space for the jaws" : "waiting";
      row.className = next ? "next" : "";
      row.append(...[number, names[kind], `${(1e3 * (last - y)).toFixed(0)} mm`, state].map((words) => {
        const place = document.createElement("td");
        place.textContent = words;
        return place;
      }));
      return row;
    }));
  }

  box([xLow, xHigh], [yLow, yHigh], colour) {
    const [u, v] = this.at(xHigh, yLow), [u1, v1] = this.at(xLow, yHigh);
    this.pen.fillStyle = colour;
    this.pen.fillRect(u, v, u1 - u, v1 - v);
  }

  line(from, to) {
    this.pen.beginPath();
    this.pen.moveTo(...this.at(...from));
    this.pen.lineTo(...this.at(...to));
    this.pen.setLineDash([4, 4]);
    this.stroke(NEXT, 1);
    this.pen.setLineDash([]);
  }

  polygon(corners) {
    this.pen.beginPath();
    for (const [x, y] of corners) this.pen.lineTo(...this.at(x, y));
    this.pen.closePath();
  }

  stroke(colour, width = 1) {
    this.pen.strokeStyle = colour;
    this.pen.lineWidth = width;
    this.pen.stroke();
  }
}

function placed(outline, x, y, yaw) {
  const [c, s] = [Math.cos(yaw), Math.sin(yaw)];
  return outline.map(([a, b]) => [x + c * a - s * b, y + s * a + c * b]);
}
