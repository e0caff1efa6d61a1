// Rules for the studio's page. ESLint and what it needs are installed for node, outside of the checkout.
import { createRequire } from "node:module";

const require = createRequire(import.meta.url); // which looks in NODE_PATH, too
const js = require("@eslint/js");
const globals = require("globals");

export default [
  { ignores: ["**/vendor/**"] },
  js.configs.recommended,
  {
    files: ["**/*.js"],
    languageOptions: { ecmaVersion: 2024, sourceType: "module", globals: globals.browser },
    linterOptions: { reportUnusedDisableDirectives: "error" },
    rules: {
      eqeqeq: ["error", "always"],
      "max-lines": ["error", { max: 400 }],
      "no-alert": "error",
      "no-console": ["error", { allow: ["warn", "error"] }],
      "no-control-regex": "off", // names are cleared of them
      "no-eval": "error",
      "no-implied-eval": "error",
      "no-new-func": "error",
      "no-restricted-properties": [
        "error",
        ...["innerHTML", "outerHTML"].map((property) => ({ property, message: "build elements, or use Preact" })),
        { object: "document", property: "write", message: "build elements, or use Preact" },
      ],
      "no-shadow": "error",
      "no-unused-vars": ["error", { args: "after-used", varsIgnorePattern: "^_" }],
      "no-var": "error",
      "object-shorthand": "error",
      "prefer-const": ["error", { ignoreReadBeforeAssign: true }],
      "prefer-template": "error",
    },
  },
];
