// The strips: a ribbon of phases, and below it, on the same time axis, one row for each strip.

const LABEL = 246, VALUE = 92, RIBBON = 18, GAP = 7, AXIS = 16;
const FONT = 'system-ui, "DejaVu Sans", sans-serif';
const BRIGHT = "#f2f4f6", MEDIUM = "#a3abb5", DIM = "#6b747f", RULE = "#262c33", ROW = "#12161a";
const LINES = { bright: "#4cc2ff", faint: "#7d8793" };

export class Strips {
  constructor(canvas) {
    this.canvas = canvas;
    this.samples = [];
    this.phases = [];
    this.strips = [];
    this.span = 20; // seconds of simulated time in view
    this.now = 0;
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  describe(phases, strips, span, ribbon) {
    this.title = ribbon || "Phase";
    this.phases = phases;
    this.strips = strips;
    this.span = span;
    this.draw();
  }

  add(samples, afresh) {
    if (afresh) this.samples = [];
    this.samples.push(...samples);
  }

  draw() {
    const ratio = window.devicePixelRatio || 1;
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !this.strips.length) return;
    if (this.canvas.width !== Math.round(width * ratio) || this.canvas.height !== Math.round(height * ratio)) {
      this.canvas.width = Math.round(width * ratio);
      this.canvas.height = Math.round(height * ratio);
    }
    const pen = this.canvas.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    const left = LABEL, right = width - VALUE;
    const end = Math.max(this.now, this.span), begin = end - this.span;
    const x = (time) => left + ((time - begin) / this.span) * (right - left);
    const first = this.firstAfter(begin);
    this.ribbon(pen, x, first, left, right);
    const row = (height - RIBBON - AXIS) / this.strips.length;
    let column = 2;
    this.strips.forEach((strip, k) => {
      this.row(pen, strip, column, x, first, left, right, RIBBON + k * row + GAP, row - GAP);
      column += strip.lines.length;
    });
    this.axis(pen, x, begin, end, left, right, height);
  }

  firstAfter(time) {
    let low = 0, high = this.samples.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.samples[middle][0] < time) low = middle + 1; else high = middle;
    }
    return Math.max(low - 1, 0);
  }

  ribbon(pen, x, first, left, right) {
    text(pen, this.title, 0, 13, 12, BRIGHT, "600");
    pen.fillStyle = ROW;
    pen.fillRect(left, 0, right - left, RIBBON);
    for (let k = first; k < this.samples.length;) {
      const phase = this.samples[k][1];
      let j = k;
      while (j < this.samples.length && this.samples[j][1] === phase) j++;
      const from = Math.max(x(this.samples[k][0]), left);
      const to = x(j < this.samples.length ? this.samples[j][0] : Math.max(this.now, this.samples[j - 1][0]));
      const { name, colour } = this.phases[phase];
      pen.fillStyle = colour;
      pen.fillRect(from, 0, Math.max(to - from, 1), RIBBON);
      pen.font = `600 11px ${FONT}`;
      if (pen.measureText(name).width + 12 < to - from) text(pen, name, from + 6, 13, 11, "#0c0e10", "600");
      k = j;
    }
    const newest = this.samples.at(-1);
    if (newest) text(pen, this.phases[newest[1]].name, right + VALUE, 13, 12, BRIGHT, "600", "right");
  }

  row(pen, strip, column, x, first, left, right, top, height) {
    const bottom = top + height;
    pen.fillStyle = ROW;
    pen.fillRect(left, top, right - left, height);
    const middle = top + height / 2;
    text(pen, strip.title, 0, middle - 3, 12, BRIGHT, "600");
    text(pen, strip.meaning, 0, middle + 12, 11, DIM);
    const top_value = strip.top ?? this.top(column, strip.lines.length, first);
    text(pen, `${top_value}`, left - 6, top + 9, 10, DIM, "", "right");
    text(pen, "0", left - 6, bottom - 1, 10, DIM, "", "right");
    pen.save();
    pen.beginPath();
    pen.rect(left, top - 1, right - left, height + 2);
    pen.clip();
    const y = (value) => bottom - 1 - Math.min(Math.max(value / top_value, 0), 1) * (height - 2);
    strip.lines.forEach(([, style], line) => {
      pen.beginPath();
      let down = false;
      for (let k = first; k < this.samples.length; k++) {
        const value = this.samples[k][column + line];
        if (value === null) { down = false; continue; }
        if (down) pen.lineTo(x(this.samples[k][0]), y(value)); else pen.moveTo(x(this.samples[k][0]), y(value));
        down = true;
      }
      pen.strokeStyle = LINES[style];
      pen.lineWidth = style === "bright" ? 1.6 : 1;
      pen.lineJoin = "round";
      pen.stroke();
    });
    pen.restore();
    const value = this.samples.at(-1)?.[column + strip.lines.length - 1];
    const known = value !== null && value !== undefined;
    const words = known ? value.toFixed(strip.decimals) : "\u2013";
    text(pen, strip.unit, right + VALUE, middle + 5, 11, DIM, "", "right");
    text(pen, words, right + VALUE - 27, middle + 5, 15, known ? BRIGHT : DIM, "600", "right");
  }

  // The end of a scale for the values in view: the next of 1, 2, 5, 10, ...
  top(column, lines, first) {
    let most = 0;
    for (let k = first; k < this.samples.length; k++) {
      for (let line = 0; line < lines; line++) most = Math.max(most, this.samples[k][column + line] ?? 0);
    }
    const power = 10 ** Math.floor(Math.log10(most || 1));
    return Number((power * [1, 2, 5, 10].find((step) => step * power >= most)).toPrecision(1));
  }

  axis(pen, x, begin, end, left, right, height) {
    pen.strokeStyle = "#ffffff10";
    pen.lineWidth = 1;
    const step = this.span / 10;
    for (let time = Math.ceil(begin / step) * step; time <= end; time += step) {
      const at = Math.round(x(time)) + 0.5;
      pen.beginPath();
      pen.moveTo(at, RIBBON + GAP);
      pen.lineTo(at, height - AXIS);
      pen.stroke();
      const side = at > right - 12 ? "right" : at < left + 12 ? "left" : "center";
      text(pen, `${time} s`, at, height - 3, 10, DIM, "", side);
    }
  }
}

function text(pen, words, x, y, size, colour, weight = "", align = "left") {
  pen.font = `${weight} ${size}px ${FONT}`;
  pen.fillStyle = colour;
  pen.textAlign = align;
  pen.fillText(words, x, y);
}
