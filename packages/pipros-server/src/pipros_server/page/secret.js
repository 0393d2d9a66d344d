// The token of the server. It is removed from the address and stored for this tab.
// It is never stored in a cookie: browsers send cookies to every server on the same host.

const KEEP = "pipros.token"; // key of the token that the server has accepted
const TRIED = "pipros.proof"; // key of the proof that the server has not answered yet, for a reload in the meantime
const IN_ADDRESS = /^#(token|code)=([\w.~-]*)\/?/;

/** First message to the server. @type {{token?: string, code?: string} | null} */
let proof = JSON.parse(stored(TRIED)) ?? (stored(KEEP) ? { token: stored(KEEP) } : null);

function stored(key) {
  try {
    return sessionStorage.getItem(key);
  } catch {
    return null; // the browser denies storage to this page
  }
}

function store(key, text) {
  try {
    if (text) sessionStorage.setItem(key, text);
    else sessionStorage.removeItem(key);
  } catch {
    // without storage, a reload needs the printed address again
  }
}

// Removes the token or one-time code from the address. Returns whether there was one.
export function takeFromAddress() {
  const found = IN_ADDRESS.exec(location.hash);
  if (!found) return false;
  proof = { [found[1]]: found[2] };
  store(TRIED, JSON.stringify(proof));
  history.replaceState(null, "", `${location.pathname}#${location.hash.slice(found[0].length)}`);
  return true;
}

export const currentProof = () => proof;

// Whether the server has accepted this token before, in this tab. If it now rejects the token, the server was restarted.
export const wasAccepted = () => proof?.token !== undefined && proof.token === stored(KEEP);

// The server accepted the proof, and sent the token.
export function accepted(token) {
  proof = { token };
  store(KEEP, token);
  store(TRIED, null);
}

// The server rejected the proof.
export function refused() {
  proof = null;
  store(KEEP, null);
  store(TRIED, null);
}

takeFromAddress();
