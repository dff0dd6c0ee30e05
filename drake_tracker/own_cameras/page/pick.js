"use strict";
// The first image of each camera; what is drawn on it goes to the server as texts of --roi and --follow.
const main = document.getElementById("cameras");
const said = document.getElementById("said");
const start = document.getElementById("start");
const cameras = [];

function tool() {
  return document.querySelector("input[name=tool]:checked").value;
}

function pixel(canvas, event) {
  const box = canvas.getBoundingClientRect();
  const u = ((event.clientX - box.left) / box.width) * canvas.width - 0.5;
  const v = ((event.clientY - box.top) / box.height) * canvas.height - 0.5;
  const within = (x, size) => Math.min(Math.max(Math.round(x), 0), size - 1);
  return [within(u, canvas.width), within(v, canvas.height)];
}

function draw(camera) {
  const context = camera.canvas.getContext("2d");
  const thick = Math.max(2, camera.canvas.width / 320);
  context.drawImage(camera.image, 0, 0);
  context.lineWidth = thick;
  if (camera.corners.length) {
    context.strokeStyle = "#ffb000";
    context.beginPath();
    camera.corners.forEach(([u, v]) => context.lineTo(u + 0.5, v + 0.5));
    context.closePath();
    context.stroke();
    camera.corners.forEach(([u, v]) => context.strokeRect(u + 0.5 - thick, v + 0.5 - thick, 2 * thick, 2 * thick));
  }
  if (camera.object) {
    const [u, v] = camera.object;
    context.strokeStyle = "#4cc2ff";
    context.beginPath();
    context.arc(u + 0.5, v + 0.5, 6 * thick, 0, 2 * Math.PI);
    context.moveTo(u + 0.5 - 9 * thick, v + 0.5);
    context.lineTo(u + 0.5 + 9 * thick, v + 0.5);
    context.moveTo(u + 0.5, v + 0.5 - 9 * thick);
    context.lineTo(u + 0.5, v + 0.5 + 9 * thick);
    context.stroke();
  }
  start.disabled = !cameras.some((each) => each.object || each.corners.length > 2);
}

function add(size, number, count) {
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = size;
  const figure = document.createElement("figure");
  const caption = document.createElement("figcaption");
  caption.textContent = count === 1 ? `${size[0]} × ${size[1]} px` : ["Left camera", "Right camera"][number];
  figure.append(canvas, caption);
  main.append(figure);
  const camera = { canvas, image: new Image(), corners: [], object: null, from: null };
  camera.image.onload = () => draw(camera);
  camera.image.src = `/image${number}.png`;
  cameras.push(camera);
  canvas.addEventListener("pointerdown", (event) => {
    const at = pixel(canvas, event);
    if (tool() === "follow") camera.object = at;
    else if (tool() === "polygon") camera.corners = camera.from ? [at] : [...camera.corners, at];
    if (tool() === "polygon") camera.from = null;
    if (tool() === "rectangle") {
      camera.from = at;
      camera.dragging = true;
      canvas.setPointerCapture(event.pointerId);
    }
    draw(camera);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!camera.dragging) return;
    const [u, v] = pixel(canvas, event);
    const [a, b] = camera.from;
    camera.corners = [[a, b], [u, b], [u, v], [a, v]];
    draw(camera);
  });
  canvas.addEventListener("pointerup", () => { camera.dragging = false; });
}

document.getElementById("clear").addEventListener("click", () => {
  cameras.forEach((camera) => {
    camera.corners = [];
    camera.object = null;
    camera.from = null;
    draw(camera);
  });
  said.textContent = "";
});

start.addEventListener("click", async () => {
  const text = (places) => places.map((place) => place.join(",")).join(" ");
  const roi = cameras.filter((camera) => camera.corners.length > 2).map((camera) => text(camera.corners));
  const follow = cameras.filter((camera) => camera.object).map((camera) => text([camera.object]));
  try {
    const answer = await fetch("/pick", { method: "POST", body: JSON.stringify({ roi, follow }) });
    said.textContent = answer.ok ? "Tracking has begun. You can close this page." : await answer.text();
    start.disabled = answer.ok;
  } catch {
    said.textContent = "drake-tracker no longer runs.";
  }
});

fetch("/cameras").then((answer) => answer.json()).then((sizes) => sizes.forEach((size, k) => add(size, k, sizes.length)));
