// The token of the server. It comes in the address, which must not keep it, and stays in this tab.
// It is never in a cookie: browsers send those to every server on the same host.

const KEEP = "pipros.token";
const IN_ADDRESS = /^#(token|code)=([\w-]*)\/?/;

let proof = kept() ? { token: kept() } : null; // what the server gets as the first message

function kept() {
  try {
    return sessionStorage.getItem(KEEP);
  } catch {
    return null; // the browser lets this page keep nothing
  }
}

function keep(token) {
  try {
    if (token) sessionStorage.setItem(KEEP, token);
    else sessionStorage.removeItem(KEEP);
  } catch {
    // then a reload needs the printed address again
  }
}

// Takes the token, or the one-time code, out of the address; says whether there was one.
export function takeFromAddress() {
  const found = IN_ADDRESS.exec(location.hash);
  if (!found) return false;
  proof = { [found[1]]: found[2] };
  history.replaceState(null, "", `${location.pathname}#${location.hash.slice(found[0].length)}`);
  return true;
}

export const currentProof = () => proof;

// The server accepted the proof, and says what the token is.
export function accepted(token) {
  proof = { token };
  keep(token);
}

// The server did not accept it.
export function refused() {
  proof = null;
  keep(null);
}

takeFromAddress();
