// Entries of the log in groups: equal ones that follow one another are one row with a count.

const [LEVEL, NODE, TEXT] = [0, 1, 2];
const ERROR = 8;

const keyOf = (entry) => `${entry[LEVEL]} ${entry[NODE]} ${entry[TEXT]}`;

export class LogGroups {
  constructor() {
    this.isFolding = true;
    this.all = []; // {entry, first, count, key}: the newest entry of each
  }

  // Replaces all entries.
  set(entries) {
    this.all = [];
    this.add(entries);
  }

  add(entries) {
    for (const entry of entries) {
      const key = this.isFolding ? keyOf(entry) : "";
      const last = this.all.at(-1);
      if (key && last?.key === key) {
        last.entry = entry;
        last.count += 1;
      } else this.all.push({ entry, first: entry, count: 1, key });
    }
  }

  // Returns the index of the first error after an index, or else of the first one of all; -1 if there is none.
  nextError(after) {
    const isError = ({ entry }) => entry[LEVEL] >= ERROR;
    const next = this.all.findIndex((group, index) => index > after && isError(group));
    return next >= 0 ? next : this.all.findIndex(isError);
  }
}
