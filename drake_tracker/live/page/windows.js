// Windows around the circles of the board: drawn on the page, measured and checked by the run.

const COLOURS = ["#4cc2ff", "#ffb000", "#2bb58a", "#cc79a7"];
const CLICK = 18; // side of the window [px of the image] that a click sets
const ENLARGED = 4;

export class Windows {
  constructor(panel, size, count, send) {
    this.panel = panel;
    this.size = size;
    this.count = count;
    this.send = send; // (action, values) -> answer of the run
    this.windows = [];
    this.drag = null;
    this.canvas = panel.querySelector("#picture");
    [this.canvas.width, this.canvas.height] = size.map((n) => n * ENLARGED);
    this.image = new Image();
    this.image.onload = () => this.draw();
    this.image.src = "/board.png";
    this.canvas.onpointerdown = (event) => this.begin(event);
    this.canvas.onpointermove = (event) => this.move(event);
    this.canvas.onpointerup = (event) => this.end(event);
    panel.querySelector("#use").onclick = () => this.answer(this.windows.map((each) => each.window));
    panel.querySelector("#alone").onclick = () => this.answer([]);
    panel.querySelector("#undo").onclick = () => { this.windows.pop(); this.show(); };
    this.show();
  }

  place(event) {
    const box = this.canvas.getBoundingClientRect();
    const scale = Math.min(box.width / this.size[0], box.height / this.size[1]);
    const x = (event.clientX - box.left - (box.width - scale * this.size[0]) / 2) / scale;
    const y = (event.clientY - box.top - (box.height - scale * this.size[1]) / 2) / scale;
    return [clamp(x, this.size[0]), clamp(y, this.size[1])];
  }

  begin(event) {
    if (this.windows.length >= this.count) return;
    this.canvas.setPointerCapture(event.pointerId);
    const at = this.place(event);
    this.drag = [at, at];
    this.draw();
  }

  move(event) {
    if (!this.drag) return;
    this.drag[1] = this.place(event);
    this.draw();
  }

  async end(event) {
    if (!this.drag) return;
    let [[x0, y0], [x1, y1]] = [this.drag[0], this.place(event)];
    this.drag = null;
    if (Math.abs(x1 - x0) < 3 || Math.abs(y1 - y0) < 3) {
      [x0, y0, x1, y1] = [x0 - CLICK / 2, y0 - CLICK / 2, x0 + CLICK / 2, y0 + CLICK / 2];
    }
    const [u0, u1] = [Math.min(x0, x1), Math.max(x0, x1)].map((x) => Math.round(clamp(x, this.size[0])));
    const [v0, v1] = [Math.min(y0, y1), Math.max(y0, y1)].map((y) => Math.round(clamp(y, this.size[1])));
    const reply = await this.send("read", { window: [u0, v0, u1 - u0, v1 - v0] });
    if (reply.problem) this.show(reply.problem);
    else {
      this.windows.push(reply);
      this.show();
    }
  }

  async answer(windows) {
    const reply = await this.send("mark", { windows });
    if (reply.problem) this.show(reply.problem);
  }

  show(problem = "") {
    const list = this.panel.querySelector("#marked");
    list.replaceChildren(...Array.from({ length: this.count }, (_, k) => {
      const item = document.createElement("li");
      const circle = this.windows[k];
      item.className = circle ? "done" : k === this.windows.length ? "next" : "";
      const found = circle ? `at (${circle.u.toFixed(1)}, ${circle.v.toFixed(1)}), ${circle.area} dark px` : "";
      item.textContent = `${k + 1}  ${found || (item.className === "next" ? "drag or click in the image" : "")}`;
      return item;
    }));
    this.panel.querySelector("#problem").textContent = problem;
    this.panel.querySelector("#use").disabled = this.windows.length < this.count;
    this.panel.querySelector("#undo").disabled = !this.windows.length;
    this.draw();
  }

  draw() {
    const pen = this.canvas.getContext("2d");
    pen.imageSmoothingEnabled = false;
    pen.drawImage(this.image, 0, 0, this.canvas.width, this.canvas.height);
    pen.lineWidth = 3;
    pen.font = '600 22px system-ui, "DejaVu Sans", sans-serif';
    this.windows.forEach(({ window: [u, v, width, height], u: cu, v: cv }, k) => {
      pen.strokeStyle = pen.fillStyle = COLOURS[k];
      pen.strokeRect(u * ENLARGED, v * ENLARGED, width * ENLARGED, height * ENLARGED);
      pen.fillText(k + 1, u * ENLARGED, v * ENLARGED - 8);
      pen.beginPath();
      pen.arc((cu + 0.5) * ENLARGED, (cv + 0.5) * ENLARGED, 5, 0, 2 * Math.PI);
      pen.fill();
    });
    if (this.drag) {
      const [[x0, y0], [x1, y1]] = this.drag;
      pen.strokeStyle = COLOURS[this.windows.length];
      pen.setLineDash([8, 6]);
      pen.strokeRect(x0 * ENLARGED, y0 * ENLARGED, (x1 - x0) * ENLARGED, (y1 - y0) * ENLARGED);
      pen.setLineDash([]);
    }
  }
}

const clamp = (value, size) => Math.min(Math.max(value, 0), size);
