// Number boxes act on Enter or when they are left, not on every key: "20" is not first 2.

const BOX = 'input[inputmode="decimal"], input[inputmode="numeric"]';

// React takes a value with the events "input" and "change"; the browser sends "change" at the end.
window.addEventListener('input', (event) => {
  if (event.target.matches(BOX)) event.stopImmediatePropagation();
}, true);

// Its number box notes at each key the selection that the key replaces: here the whole number.
window.addEventListener('change', ({ target }) => {
  if (!target.matches(BOX)) return;
  target.select();
  target.dispatchEvent(new KeyboardEvent('keydown', { bubbles: true }));
}, true);

// A click on an attempt shows it in the charts.
document.addEventListener('click', (event) => {
  const row = event.target.closest('[data-khr-attempt]');
  if (row) fetch(`khr/attempt/${row.dataset.khrAttempt}`, { cache: 'no-store' });
});
