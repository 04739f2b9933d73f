// What VS Code's own engine of TextMate grammars makes of scenes, as JSON: for each file a list for each line of
// [column, text, scope]. node textmate_tokens.js GRAMMAR SCENE...; `vscode-textmate` and `vscode-oniguruma` are of npm.
"use strict";
const fs = require("fs");
const path = require("path");
const textmate = require("vscode-textmate");
const oniguruma = require("vscode-oniguruma");

const [, , file, ...scenes] = process.argv;

async function main() {
  const wasm = path.join(path.dirname(require.resolve("vscode-oniguruma")), "onig.wasm");
  await oniguruma.loadWASM(fs.readFileSync(wasm).buffer);
  const engine = {
    createOnigScanner: (patterns) => new oniguruma.OnigScanner(patterns),
    createOnigString: (text) => new oniguruma.OnigString(text),
  };
  const registry = new textmate.Registry({
    onigLib: Promise.resolve(engine),
    loadGrammar: async () => textmate.parseRawGrammar(fs.readFileSync(file, "utf8"), file),
  });
  const grammar = await registry.loadGrammar("source.softmark");
  const found = {};
  for (const scene of scenes) {
    let state = textmate.INITIAL;
    found[scene] = fs
      .readFileSync(scene, "utf8")
      .split(/\r?\n/)
      .map((line) => {
        const { tokens, ruleStack } = grammar.tokenizeLine(line, state);
        state = ruleStack;
        return tokens
          .filter((t) => t.scopes.length > 1)
          .map((t) => [t.startIndex, line.slice(t.startIndex, t.endIndex), t.scopes[1]]);
      });
  }
  console.log(JSON.stringify(found));
}
main();
