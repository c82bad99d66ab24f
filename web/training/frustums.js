// The cameras of the photographs, drawn over the scene.
const REACH = 14, NEAR = 1e-3;  // CSS pixels around a camera that belong to it; nearest depth, of the camera's distance

const minus = (a, b) => a.map((value, i) => value - b[i]);
const size = (a) => Math.hypot(...a);

/** Takes points of the world to a picture: [x, y, depth], pixels. */
export function projection(camera, width, height) {
  const [right, up, back] = [0, 4, 8].map((at) => camera.matrix.slice(at, at + 3));
  const half = Math.tan((camera.fov * Math.PI) / 360);
  // A narrower picture shows the same width, a wider one the same height.
  const focal = Math.min((0.5 * height) / half, (0.5 * width) / (half * camera.aspect));
  return (point) => {
    const from = minus(point, camera.position), along = (axis) => axis.reduce((sum, a, i) => sum + a * from[i], 0);
    const depth = -along(back);
    return [0.5 * width + (focal * along(right)) / depth, 0.5 * height - (focal * along(up)) / depth, depth];
  };
}

/** Eye and four corners of a camera's picture at a distance. */
function pyramid(camera, distance) {
  const [right, up, back] = [0, 4, 8].map((at) => camera.matrix.slice(at, at + 3));
  const h = distance * Math.tan((camera.fov * Math.PI) / 360), w = h * camera.aspect;
  const corner = (x, y) => camera.position.map((p, i) => p - distance * back[i] + x * w * right[i] + y * h * up[i]);
  return [camera.position, corner(-1, 1), corner(1, 1), corner(1, -1), corner(-1, -1)];
}

/** A size for frustums: they do not hide each other. */
function distanceOf(cameras) {
  const nearest = cameras.map((a) => Math.min(...cameras.filter((b) => b !== a)
    .map((b) => size(minus(a.position, b.position))).filter((d) => d > 0)))
    .filter(Number.isFinite).sort((a, b) => a - b);
  const target = cameras.length > 0 ? size(minus(cameras[0].position, cameras[0].target)) : 1;
  return nearest.length > 0 ? Math.min(0.6 * nearest[nearest.length >> 1], 0.3 * target) : 0.1 * target;
}

/** Index of the camera whose picture is most like that of another, as nearest_camera() in viewer/frustums.cpp. */
export function nearestCamera(cameras, { position, target, matrix }) {
  const reach = size(minus(target, position)) || 1;
  const costs = cameras.map((camera) => {
    const cosine = [8, 9, 10].reduce((sum, i) => sum + camera.matrix[i] * matrix[i], 0);
    return size(minus(camera.position, position)) / reach + Math.acos(Math.max(-1, Math.min(1, cosine)));
  });
  return costs.length > 0 ? costs.indexOf(Math.min(...costs)) : null;
}

export class Frustums {
  #cameras = []; #shapes = []; #test = []; #canvas; #soup; #at = [];

  constructor(canvas, soup) {
    this.#canvas = canvas;
    this.#soup = soup;
  }

  get cameras() { return this.#cameras; }
  get shown() { return !this.#canvas.hidden; }
  set shown(shown) {
    this.#canvas.hidden = !shown;
    this.draw();
  }

  /** @param {object[]} cameras as `tri-soup`'s @param {boolean[]} test which are test views */
  set(cameras, test) {
    const distance = distanceOf(cameras.slice(0, 500));
    this.#cameras = cameras;
    this.#test = test;
    this.#shapes = cameras.map((camera) => pyramid(camera, distance));
    this.draw();
  }

  draw() {
    const { camera } = this.#soup, canvas = this.#canvas;
    if (canvas.hidden || !camera) return;
    const { clientWidth: width, clientHeight: height } = canvas;
    canvas.width = Math.round(width * devicePixelRatio);
    canvas.height = Math.round(height * devicePixelRatio);
    const context = canvas.getContext("2d"), project = projection(camera, width, height);
    const least = NEAR * (size(minus(camera.target, camera.position)) || 1);
    context.scale(devicePixelRatio, devicePixelRatio);
    context.lineWidth = 1.25;
    this.#at = this.#shapes.map((shape, i) => {
      const [eye, a, b, c, d] = shape.map(project), points = [eye, a, b, c, d];
      // From the eye itself a frustum is its picture's frame.
      if (i === camera.index || points.some(([, , depth]) => depth < least)) return null;
      context.strokeStyle = this.#test[i] ? "#ffb340" : "#5ab0ff";
      context.beginPath();
      for (const [from, to] of [[eye, a], [eye, b], [eye, c], [eye, d], [a, b], [b, c], [c, d], [d, a]]) {
        context.moveTo(from[0], from[1]);
        context.lineTo(to[0], to[1]);
      }
      context.stroke();
      return eye;
    });
  }

  /** The camera at a place, CSS pixels; null if there is none. */
  at(x, y) {
    let best = null, least = REACH;
    this.#at.forEach((eye, i) => {
      const distance = eye ? Math.hypot(eye[0] - x, eye[1] - y) : Infinity;
      if (this.shown && distance < least) least = distance, best = i;
    });
    return best;
  }
}
