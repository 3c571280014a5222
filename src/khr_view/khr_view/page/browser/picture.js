// Save the charts as they are shown, zoomed and all, in one picture for a slide.

const WIDTH = 960; // px of the picture, of the size of a letter
const SCALE = 2; // pixels of the picture for each of these
const EDGE = 12; // px about each chart
const LINE = 18; // px of a line of text
const SAMPLE = 26; // px of a line in a legend
const SIZES = ['width', 'height'];

/** Have a canvas keep SCALE pixels for each that is drawn on it. */
function sharpen(canvas) {
  for (const size of SIZES) {
    const { get, set } = Object.getOwnPropertyDescriptor(HTMLCanvasElement.prototype, size);
    Object.defineProperty(canvas, size, {
      configurable: true,
      get() { return get.call(this) / SCALE; },
      set(value) {
        set.call(this, value * SCALE);
        this.getContext('2d').setTransform(SCALE, 0, 0, SCALE, 0, 0);
      },
    });
  }
}

/** Give a chart another width, and wait until uPlot has drawn it, which is before the next frame. */
async function widen(chart, width) {
  chart.setSize({ width, height: chart.height });
  await null;
}

/** Place items of some widths in lines of at most this width; return where the last one ends. */
function place(items, left, top, width) {
  let [x, y] = [left, top + LINE];
  for (const { long, paint } of items) {
    if (x > left && x + long > left + width) [x, y] = [left, y + LINE];
    paint(x, y);
    x += long;
  }
  return y;
}

/** Write a text in lines of at most this width; return where the last one ends. */
function write(context, text, left, top, width) {
  const items = text.split(' ').map((word) => ({
    long: context.measureText(`${word} `).width,
    paint: (x, y) => context.fillText(word, x, y),
  }));
  return place(items, left, top, width);
}

/** Return a legend's item: a piece of the line, or its shade, and its name without a word of the dash. */
function item(context, series, color) {
  const name = series.label.replace(/ \(.*\)$/, '');
  return {
    long: SAMPLE + context.measureText(`${name}    `).width,
    paint(x, y) {
      context.fillText(name, x + SAMPLE + 4, y);
      context.save();
      context.fillStyle = series.fill?.() ?? 'transparent';
      context.fillRect(x, y - 9, SAMPLE, 10);
      context.beginPath();
      context.moveTo(x, y - 4);
      context.lineTo(x + SAMPLE, y - 4);
      context.setLineDash(series.dash ?? []);
      context.strokeStyle = series.stroke?.() ?? color;
      context.lineWidth = series.width;
      if (series.width) context.stroke();
      context.restore();
    },
  };
}

/** Draw a chart's title, lines and legend; return where the next one begins. */
function draw(context, chart, color, left, top) {
  const { root, ctx, width, height, series, data } = chart;
  context.fillStyle = color;
  context.font = '600 13px system-ui, sans-serif';
  const title = root.querySelector('.u-title').textContent;
  const bottom = write(context, title, left, top, width) + EDGE / 2;
  context.drawImage(ctx.canvas, left, bottom, width, height);
  context.font = '12px system-ui, sans-serif';
  const drawn = series.filter((each, n) => n && each.show && holds(each, data[n]));
  const legend = drawn.map((each) => item(context, each, color));
  return place(legend, left, bottom + height, width) + 2 * EDGE;
}

/** Whether there is something to see of a line: a value, or of a shade one that is not zero. */
const holds = ({ scale }, values) => values.some((value) => (scale === 'phase' ? value : value !== null));

async function save() {
  const charts = Object.values(window.__viserTestpoints.uplots).map((each) => each.chart)
    .filter(({ root, data }) => root.offsetParent && data[0].some(Boolean)); // else it is empty
  const columns = Math.min(charts.length, 2) || 1;
  const width = (WIDTH - EDGE) / columns - EDGE;
  const usual = charts.map((each) => each.width);
  charts.forEach(({ ctx }) => sharpen(ctx.canvas));
  await Promise.all(charts.map((each) => widen(each, width)));
  const picture = compose(charts, columns, width);
  for (const { ctx } of charts) SIZES.forEach((size) => delete ctx.canvas[size]);
  charts.forEach((each, n) => widen(each, usual[n]));
  picture.toBlob((blob) => {
    const link = document.createElement('a');
    link.href = URL.createObjectURL(blob);
    link.download = 'charts.png';
    link.click();
    URL.revokeObjectURL(link.href);
  });
}

/** Draw the charts in columns beneath a heading. */
function compose(charts, columns, width) {
  const { color, backgroundColor } = getComputedStyle(document.body);
  const heading = document.querySelector('[data-khr-title]')?.dataset.khrTitle ?? '';
  const sheet = document.createElement('canvas');
  const context = sheet.getContext('2d');
  const paint = () => {
    context.fillStyle = color;
    context.font = '600 15px system-ui, sans-serif';
    let bottom = EDGE / 2;
    for (const line of heading.split('\n')) {
      bottom = write(context, line, EDGE, bottom, WIDTH - 2 * EDGE);
    }
    let top = bottom + EDGE / 2;
    for (let row = 0; row < charts.length; row += columns) {
      const ends = charts.slice(row, row + columns).map(
        (each, n) => draw(context, each, color, EDGE + n * (width + EDGE), top));
      top = Math.max(...ends);
    }
    return top;
  };
  sheet.width = WIDTH * SCALE;
  sheet.height = paint() * SCALE; // the first time to measure
  context.scale(SCALE, SCALE);
  context.fillStyle = backgroundColor;
  context.fillRect(0, 0, WIDTH, sheet.height);
  paint();
  return sheet;
}

document.addEventListener('click', (event) => {
  if (event.target.closest('[data-khr="picture"]')) save();
});
