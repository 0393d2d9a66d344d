// Rules for the page's JavaScript: `script/check page`.

const js = require("@eslint/js");
const globals = require("globals");

const LONG = ["graph/canvas", "tabs/bags", "tabs/console", "tabs/graph", "tabs/images", "tabs/panels", "tabs/plot"];

module.exports = [
  js.configs.recommended,
  {
    ignores: ["**/vendor/**", "**/bundle/**"],
  },
  {
    files: ["**/*.js", "**/*.mjs"],
    languageOptions: { ecmaVersion: 2023, sourceType: "module", globals: globals.browser },
    rules: {
      "complexity": ["error", 15],
      "eqeqeq": "error",
      "max-len": ["error", { code: 140 }],
      "max-lines": ["error", 320],
      "max-lines-per-function": ["error", 80],
      "no-unused-vars": ["error", { argsIgnorePattern: "^_" }],
      "no-implicit-globals": "error",
      "no-restricted-properties": ["error", { property: "innerHTML" }, { property: "outerHTML" }, { property: "insertAdjacentHTML" }],
      "no-shadow": "error",
      "no-var": "error",
      "prefer-const": "error",
    },
  },
  {
    // Functions that build a tab, or a part of one, and share its state among their inner functions.
    files: LONG.map((name) => `packages/pipros-page/src/pipros_page/page/${name}.js`),
    rules: { "max-lines-per-function": ["error", 240] },
  },
  {
    files: ["packages/pipros-page/tests/page/unit/*.js"],
    languageOptions: { globals: globals.node },
  },
];
