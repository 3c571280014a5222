// Save the charts as they are shown, zoomed and all, in one picture.

const EDGE = 12; // px about each chart
const SCALE = 4; // pixels of the picture for each of the page: sharp on a slide
const TITLE = 20; // px for a title, and for a line of a legend

/** Draw a chart's title, canvas and legend at a height; return where the next one begins. */
function draw(context, chart, top, scale) {
  const canvas = chart.querySelector('canvas');
  const style = getComputedStyle(chart);
  context.fillStyle = style.color;
  context.font = `600 ${12 * scale}px system-ui, sans-serif`;
  context.fillText(chart.querySelector('.u-title').textContent, EDGE, top + TITLE / 2);
  top += TITLE * scale;
  context.drawImage(canvas, EDGE, top);
  top += canvas.height + (TITLE / 2) * scale;
  context.font = `${11 * scale}px system-ui, sans-serif`;
  let left = EDGE;
  for (const series of [...chart.querySelectorAll('.u-series')].slice(1)) {
    const label = series.querySelector('.u-label').textContent;
    context.fillStyle = series.querySelector('.u-marker').style.borderColor || style.color;
    context.fillText(label, left, top);
    left += context.measureText(label).width + EDGE * scale;
  }
  return top + TITLE * scale;
}

/** Have uPlot draw with this many pixels for each of the page. */
async function drawAt(ratio) {
  Object.defineProperty(window, 'devicePixelRatio', { value: ratio, configurable: true });
  window.dispatchEvent(new Event('dppxchange'));
  await new Promise((done) => setTimeout(done, 200));
}

async function save() {
  const usual = window.devicePixelRatio;
  await drawAt(SCALE);
  try {
    compose();
  } finally {
    await drawAt(usual);
  }
}

function compose() {
  const charts = [...document.querySelectorAll('.uplot')].filter((each) => each.offsetParent);
  const picture = document.createElement('canvas');
  const scale = window.devicePixelRatio;
  const canvases = charts.map((each) => each.querySelector('canvas'));
  const title = document.querySelector('[data-khr-title]')?.dataset.khrTitle ?? '';
  const context = picture.getContext('2d');
  const font = `600 ${13 * scale}px system-ui, sans-serif`;
  picture.width = Math.max(...canvases.map((each) => each.width)) + 2 * EDGE;
  context.font = font;
  const heading = wrap(context, title, picture.width - 2 * EDGE);
  picture.height = canvases.reduce(
    (sum, each) => sum + each.height + 2.5 * TITLE * scale + EDGE,
    EDGE + heading.length * TITLE * scale);
  const style = getComputedStyle(document.body);
  context.fillStyle = style.backgroundColor;
  context.fillRect(0, 0, picture.width, picture.height);
  context.fillStyle = style.color;
  context.font = font;
  heading.forEach((line, n) => context.fillText(line, EDGE, (n + 1) * TITLE * scale));
  const top = EDGE + (heading.length + 1) * TITLE * scale;
  charts.reduce((at, each) => draw(context, each, at, scale), top);
  picture.toBlob((blob) => {
    const link = document.createElement('a');
    link.href = URL.createObjectURL(blob);
    link.download = 'charts.png';
    link.click();
    URL.revokeObjectURL(link.href);
  });
}

/** Break a text into lines of at most this many pixels. */
function wrap(context, text, width) {
  const lines = [];
  for (const word of text.split(' ')) {
    const longer = lines.length ? `${lines.at(-1)} ${word}` : word;
    if (lines.length && context.measureText(longer).width <= width) lines[lines.length - 1] = longer;
    else lines.push(word);
  }
  return lines;
}

document.addEventListener('click', (event) => {
  if (event.target.closest('[data-khr="picture"]')) save();
});
