// Curves over the steps, on canvases.
const MARGIN = { left: 44, right: 8, top: 6, bottom: 18 };

const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name);

/** About four round values between two. */
export function ticks(low, high) {
  const span = high - low, power = 10 ** Math.floor(Math.log10(span / 4));
  const step = power * [1, 2, 5, 10].find((factor) => span / (power * factor) <= 4.5);
  const values = [];
  for (let i = Math.ceil(low / step); i * step <= high * (1 + 1e-9); ++i) values.push(i * step);
  return values;
}

/** Values 1, 2 and 5 of each power of ten between two powers of ten; others where these are fewer than two. */
export function logTicks(low, high) {
  const values = [];
  for (let power = Math.floor(low); power <= high; ++power)
    values.push(...[1, 2, 5].map((factor) => factor * 10 ** power));
  const inside = values.filter((value) => Math.log10(value) >= low && Math.log10(value) <= high);
  return inside.length >= 2 ? inside : ticks(10 ** low, 10 ** high);
}

/**
 * Draws series in one frame.
 * @param {HTMLCanvasElement} canvas
 * @param {{points: [number, number][], colour: string, dots?: boolean}[]} series colour: a CSS variable
 * @param {{steps: number, log?: boolean}} options steps: end of the axis; log: logarithmic values
 */
export function drawCurves(canvas, series, { steps, log = false }) {
  const { clientWidth: width, clientHeight: height } = canvas, ratio = devicePixelRatio;
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
  const context = canvas.getContext("2d");
  context.scale(ratio, ratio);
  const scaled = log ? Math.log10 : (value) => value;
  const values = series.flatMap(({ points }) => points.map(([, value]) => value))
    .filter((value) => Number.isFinite(value) && (!log || value > 0)).map(scaled);
  if (values.length === 0) return;
  let low = values.reduce((a, b) => Math.min(a, b)), high = values.reduce((a, b) => Math.max(a, b));
  if (high - low < 1e-6) low -= 0.5, high += 0.5;
  const pad = 0.05 * (high - low), last = Math.max(1, steps);
  low -= pad;
  high += pad;
  const right = width - MARGIN.right, bottom = height - MARGIN.bottom;
  const x = (step) => MARGIN.left + (right - MARGIN.left) * (step / last);
  const y = (value) => bottom - (bottom - MARGIN.top) * ((scaled(value) - low) / (high - low));
  drawAxes(context, { x, y, right, bottom, last, values: log ? logTicks(low, high) : ticks(low, high) });
  for (const { points, colour, dots } of series) {
    context.strokeStyle = context.fillStyle = css(colour);
    context.lineWidth = 1.5;
    context.beginPath();
    let drawing = false;
    for (const [step, value] of points) {
      const shown = Number.isFinite(value) && (!log || value > 0);
      if (shown && dots) context.moveTo(x(step) + 3, y(value)), context.arc(x(step), y(value), 3, 0, 2 * Math.PI);
      else if (shown && drawing) context.lineTo(x(step), y(value));
      else if (shown) context.moveTo(x(step), y(value));
      drawing = shown;
    }
    if (dots) context.fill();
    else context.stroke();
  }
}

function drawAxes(context, { x, y, right, bottom, last, values }) {
  context.strokeStyle = "#8884";
  context.fillStyle = css("--dim");
  context.font = "11px system-ui, sans-serif";
  context.textAlign = "right";
  context.textBaseline = "middle";
  context.beginPath();
  for (const tick of values) {
    context.moveTo(MARGIN.left, y(tick));
    context.lineTo(right, y(tick));
    context.fillText(String(Number(tick.toPrecision(6))), MARGIN.left - 5, y(tick));
  }
  context.stroke();
  context.textBaseline = "top";
  for (const tick of ticks(0, last)) {
    context.textAlign = tick === 0 ? "left" : x(tick) > right - 20 ? "right" : "center";
    context.fillText(String(tick), x(tick), bottom + 4);
  }
}
