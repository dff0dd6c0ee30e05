// Added to Meshcat's page. A browser that draws the scene without a graphics card takes the processor from the
// simulation: where drawing is slow it draws coarsely, and rests between two pictures.

// Within the live page, which says when the run is over, the scene keeps playing its recording without a server: Meshcat's
// message that there is no connection is hidden there.

const QUICK = 25; // time [ms] of one picture up to which nothing is saved
const REST = 2; // rest after a slow picture, in multiples of the time of the picture
const SURE = 5; // slow pictures in a row until it draws coarsely; a few may have other reasons, such as a window that was opened
const COARSE = 0.5; // drawn pixels per pixel of the screen

{
  if (window !== window.top) document.getElementById("status-message").style.visibility = "hidden";
  const gl = viewer.renderer.getContext(), pixel = new Uint8Array(4);
  let slow = 0, awake = 0; // number of slow pictures in a row, and end of the rest [ms]

  const draw = () => {
    const start = performance.now();
    viewer.render();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel); // waits until the picture is drawn
    const time = performance.now() - start;
    if (time <= QUICK) {
      slow = 0;
      return;
    }
    awake = performance.now() + REST * time;
    slow += 1;
    if (slow === SURE) {
      viewer.renderer.setPixelRatio(COARSE * window.devicePixelRatio);
      viewer.set_dirty();
    }
  };

  viewer.animate = () => {
    viewer.animator.update();
    if (viewer.needs_render && performance.now() >= awake) draw();
  };
}
