// A word over the page: while it loads, and once nobody serves it any more.

const PERIOD = 2000; // ms between questions whether the server is there
const LOADING = 'Loading the robot and its signals ...';
const ENDED =
  'khr has ended: no more is to come, and what you see is its last picture. ' +
  'Started again at this address, it is shown here by itself.';

const word = document.createElement('div');
word.id = 'khr-word';
word.setAttribute('role', 'status');
document.body.append(word);

/** Hide viser's empty panel until what khr shows has come. */
function awaitPage() {
  const root = document.documentElement;
  root.classList.add('khr-loading');
  word.textContent = LOADING;
  const observer = new MutationObserver(() => {
    if (document.querySelector('.khr-state')) {
      observer.disconnect();
      root.classList.remove('khr-loading');
      word.textContent = '';
    }
  });
  observer.observe(document.body, { childList: true, subtree: true });
}

async function isServed() {
  try {
    return (await fetch('khr/alive', { cache: 'no-store' })).ok;
  } catch {
    return false;
  }
}

/** Say so when the server is gone, and load the page anew when it is back. */
async function watch() {
  const gone = word.textContent === ENDED;
  const served = await isServed();
  if (served && gone) location.reload();
  if (!served) {
    document.documentElement.classList.remove('khr-loading');
    word.textContent = ENDED;
  }
  setTimeout(watch, PERIOD);
}

awaitPage();
setTimeout(watch, PERIOD);
