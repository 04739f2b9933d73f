// As much of VS Code's `vscode` module as the client of `dsl editor vscode` uses, so that it runs under Node alone.
// node vscode_stub.js CLIENT COMMAND SCENE [PLUGIN]...: opens the scene, asks everything once, prints the answers as JSON.
"use strict";
const fs = require("fs");
const Module = require("module");
const path = require("path");
const { pathToFileURL } = require("url");

const [, , client, command, scene, ...plugins] = process.argv;
const registered = {};
const listeners = {};
class Thing {
  constructor(...given) {
    this.given = given;
  }
}
const uri = (text) => ({ toString: () => text });
const collection = new Map();
const shown = [];
const stub = new Proxy(
  {
    Position: class {
      constructor(line, character) {
        Object.assign(this, { line, character });
      }
    },
    Range: class {
      constructor(start, end) {
        Object.assign(this, { start, end });
      }
      toJSON() {
        return [this.start, this.end]; // as VS Code writes it, and the protocol does not
      }
    },
    Uri: { parse: uri },
    Disposable: { from: (...all) => ({ all }) },
    MarkdownString: class {
      constructor(value) {
        this.value = value;
      }
    },
    Diagnostic: class {
      constructor(range, message, severity) {
        Object.assign(this, { range, message, severity });
      }
    },
    CompletionList: class {
      constructor(items) {
        this.items = items;
      }
    },
    CompletionItem: class {
      constructor(label, kind) {
        Object.assign(this, { label, kind });
      }
    },
    WorkspaceEdit: class {
      constructor() {
        this.edits = {};
      }
      set(where, edits) {
        this.edits[where.toString()] = edits;
      }
    },
    languages: new Proxy(
      { createDiagnosticCollection: () => ({ set: (where, found) => collection.set(where.toString(), found) }) },
      {
        get: (own, name) =>
          own[name] ??
          ((language, provider, ...rest) => {
            registered[name] = { language, provider, rest };
            return {};
          }),
      },
    ),
    commands: {
      registerCommand: (name, run) => {
        registered[name] = run;
        return {};
      },
      executeCommand: async () => null,
    },
    window: {
      showErrorMessage: (text) => {
        console.error(text);
        process.exit(3);
      },
      showWarningMessage: (text) => void shown.push(text),
      showInformationMessage: (text) => void shown.push(text),
      activeTextEditor: { document: { uri: { fsPath: scene } } },
      createOutputChannel: () => ({ append: () => {}, appendLine: () => {} }),
    },
    EventEmitter: class {
      constructor() {
        this.event = () => ({});
      }
      fire() {}
    },
    ProcessExecution: class {
      constructor(program, words, options) {
        Object.assign(this, { program, words, options });
      }
    },
    Task: class {
      constructor(definition, scope, name, source, execution) {
        Object.assign(this, { name, execution });
      }
    },
    TaskScope: { Workspace: 2 },
    tasks: { onDidEndTask: () => ({}), executeTask: (task) => task },
    workspace: new Proxy(
      {
        createFileSystemWatcher: (pattern) => {
          registered[`watched ${pattern}`] = true;
          return { onDidCreate: () => ({}), onDidChange: () => ({}), onDidDelete: () => ({}) };
        },
        getConfiguration: () => ({ get: (name) => (name === "plugins" ? plugins : command) }),
        isTrusted: process.env.STUB_TRUSTED !== "no",
        textDocuments: [],
        workspaceFolders: [{ uri: { ...uri(pathToFileURL(path.dirname(scene)).href), fsPath: path.dirname(scene) } }],
        applyEdit: async () => true,
      },
      {
        get: (own, name) =>
          own[name] ??
          ((heard) => {
            listeners[name] = heard;
            return {};
          }),
      },
    ),
  },
  { get: (own, name) => own[name] ?? Thing },
);
const load = Module._load;
Module._load = (name, ...rest) => (name === "vscode" ? stub : load(name, ...rest));

const until = async (ready) => {
  for (let n = 0; n < 600 && !ready(); n++) await new Promise((done) => setTimeout(done, 50));
};

async function main() {
  const { activate, deactivate } = require(client);
  await activate({ subscriptions: [] });
  let text = fs.readFileSync(scene, "utf8");
  const document = {
    uri: uri(pathToFileURL(scene).href),
    languageId: "softmark-scene",
    version: 1,
    getText: () => text,
  };
  listeners.onDidOpenTextDocument(document);
  const found = () => collection.get(document.uri.toString());
  await until(() => found()?.length > 0);
  const broken = found();
  const answers = {};
  const ask = async (name, method, ...given) => {
    if (registered[name]) answers[method] = await registered[name].provider[method](document, ...given);
  };
  await ask("registerCodeActionsProvider", "provideCodeActions", broken[0].range, { diagnostics: broken }, undefined);
  text = text.replace("lenth", "length");
  document.version = 2;
  listeners.onDidChangeTextDocument({ document });
  await until(() => found().length === 0);
  const lines = text.split("\n");
  const line = lines.findIndex((one) => one.includes("neo_hookean"));
  const there = { line, character: lines[line].indexOf("young") + 2 };
  await ask("registerHoverProvider", "provideHover", there, undefined);
  await ask("registerCompletionItemProvider", "provideCompletionItems", there, undefined);
  await ask(
    "registerDocumentFormattingEditProvider",
    "provideDocumentFormattingEdits",
    { tabSize: 4, insertSpaces: true },
    undefined,
  );
  await ask("registerDocumentSymbolProvider", "provideDocumentSymbols", undefined);
  const whole = new stub.Range({ line: 0, character: 0 }, { line: lines.length, character: 0 });
  await ask("registerInlayHintsProvider", "provideInlayHints", whole, undefined);
  await ask("registerCodeLensProvider", "provideCodeLenses", undefined);
  await ask("registerDocumentSemanticTokensProvider", "provideDocumentSemanticTokens", undefined);
  if (plugins.length) answers.own = registered["softmark.run"]();
  answers.run = registered["softmark.run"](scene, "--model", "rod");
  await deactivate();
  console.log(JSON.stringify({ broken, left: found(), registered: Object.keys(registered), shown, answers }));
}
main().catch((error) => {
  console.error(error);
  process.exit(1);
});
