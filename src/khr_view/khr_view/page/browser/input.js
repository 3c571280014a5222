// Number boxes act on Enter or when they are left, not on every key: "20" is not first 2.

// React takes a value with the events "input" and "change"; the browser sends "change" at the end.
window.addEventListener('input', (event) => {
  if (event.target.matches('input[inputmode="decimal"], input[inputmode="numeric"]')) {
    event.stopImmediatePropagation();
  }
}, true);

// A click on an attempt shows it in the charts.
document.addEventListener('click', (event) => {
  const row = event.target.closest('[data-khr-attempt]');
  if (row) fetch(`khr/attempt/${row.dataset.khrAttempt}`, { cache: 'no-store' });
});
