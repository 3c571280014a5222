// Save the charts as they are shown, zoomed and all, in one picture.

const EDGE = 12; // px about each chart
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

function save() {
  const charts = [...document.querySelectorAll('.uplot')].filter((each) => each.offsetParent);
  const picture = document.createElement('canvas');
  const scale = window.devicePixelRatio;
  const canvases = charts.map((each) => each.querySelector('canvas'));
  picture.width = Math.max(...canvases.map((each) => each.width)) + 2 * EDGE;
  picture.height = canvases.reduce(
    (sum, each) => sum + each.height + 2.5 * TITLE * scale + EDGE, EDGE);
  const context = picture.getContext('2d');
  context.fillStyle = getComputedStyle(document.body).backgroundColor;
  context.fillRect(0, 0, picture.width, picture.height);
  charts.reduce((top, each) => draw(context, each, top, scale), EDGE);
  picture.toBlob((blob) => {
    const link = document.createElement('a');
    link.href = URL.createObjectURL(blob);
    link.download = 'charts.png';
    link.click();
    URL.revokeObjectURL(link.href);
  });
}

document.addEventListener('click', (event) => {
  if (event.target.closest('[data-khr="picture"]')) save();
});
