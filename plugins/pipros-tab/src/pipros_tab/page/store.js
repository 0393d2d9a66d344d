// Keeps the files of the home folder in the browser's database, so that they survive a reload.

const DATABASE = "pipros-tab";
const FILES = "files";
const DELAY_MS = 300;
const NOT_KEPT = /\/\.ros\/|\/\.cache\//;

function result(request) {
  return new Promise((resolve, reject) => {
    request.onsuccess = () => resolve(request.result);
    request.onerror = () => reject(request.error);
  });
}

/** Loads the kept files into a map. Returns a function that keeps a changed file; if it cannot, `fail` is called with the error.
 * @param {Map<string, [number, Uint8Array]>} files @returns {Promise<(path: string) => void>} */
export async function keepFiles(files, fail) {
  const opening = indexedDB.open(DATABASE, 1);
  opening.onupgradeneeded = () => opening.result.createObjectStore(FILES);
  const database = await result(opening);
  const store = database.transaction(FILES).objectStore(FILES);
  const [paths, states] = await Promise.all([result(store.getAllKeys()), result(store.getAll())]);
  paths.forEach((path, at) => files.set(path, states[at]));

  const changed = new Set();
  const write = () => {
    const writing = database.transaction(FILES, "readwrite");
    writing.onabort = () => fail(writing.error);
    const target = writing.objectStore(FILES);
    for (const path of changed) {
      const state = files.get(path);
      if (state) target.put(state, path);
      else target.delete(path);
    }
    changed.clear();
    writing.commit();
  };
  addEventListener("pagehide", write); // the tab is closed, or loads another page
  return (path) => {
    if (NOT_KEPT.test(path)) return;
    if (changed.size === 0) setTimeout(write, DELAY_MS);
    changed.add(path);
  };
}
