// Mouse, touch and keyboard on the canvas.

const KEY_STEP = 0.04;
const KEY_ZOOM = 1.15;

/** Calls `turn`, `move` (shares of the canvas's height), `zoom` (a factor) and `reset` of `view`. */
export function control(canvas, view) {
  const pointers = new Map();

  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
  });
  for (const name of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(name, (event) => pointers.delete(event.pointerId));
  }
  canvas.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const now = [event.clientX, event.clientY];
    const height = canvas.clientHeight || 1;
    const [right, down] = [(now[0] - before[0]) / height, (now[1] - before[1]) / height];
    const other = [...pointers].find(([id]) => id !== event.pointerId)?.[1];
    pointers.set(event.pointerId, now);
    if (other) {
      // Each finger moves the middle between them half its way.
      view.move(right / 2, down / 2);
      const distance = ([x, y]) => Math.hypot(x - other[0], y - other[1]);
      view.zoom(Math.max(distance(now), 1) / Math.max(distance(before), 1));
    } else if (event.shiftKey || event.buttons & 6) {
      view.move(right, down);
    } else {
      view.turn(right, down);
    }
  });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 16 : 1;
    view.zoom(Math.exp((-event.deltaY * lines) / 500));
  }, { passive: false });

  canvas.addEventListener("keydown", (event) => {
    const directions = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const direction = directions[event.key];
    if (direction) {
      const [right, down] = direction.map((d) => d * KEY_STEP);
      if (event.shiftKey) view.move(right, down);
      else view.turn(right, down);
    } else if (event.key === "+" || event.key === "=") {
      view.zoom(KEY_ZOOM);
    } else if (event.key === "-") {
      view.zoom(1 / KEY_ZOOM);
    } else if (event.key === "Home") {
      view.reset();
    } else {
      return;
    }
    event.preventDefault();
  });
}
