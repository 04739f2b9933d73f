// The client of `dsl lsp` for VS Code and what is compatible with it: the Language Server Protocol over standard
// input and output, without dependencies. To add a request: a line in PROVIDERS, if the server says that it can.
"use strict";
const { spawn } = require("child_process");
const fs = require("fs");
const path = require("path");
const vscode = require("vscode");

const LANGUAGE = "softmark-scene";
const COMMANDS = ["run", "compare", "stress"]; // of dsl, which the server offers over the lines of a scene
const dsl = () => vscode.workspace.getConfiguration("softmark").get("command") || "dsl";
/** Plugins that the settings name; where the folder is not trusted, none of what lies in it. */
const plugins = () => {
  const named = vscode.workspace.getConfiguration("softmark").get("plugins") ?? [];
  if (vscode.workspace.isTrusted !== false || !Array.isArray(named)) return named;
  const folders = (vscode.workspace.workspaceFolders ?? []).map((one) => one.uri.fsPath);
  const within = (way) => !way.startsWith("..") && !path.isAbsolute(way);
  return named.filter((one) => path.isAbsolute(String(one)) && !folders.some((own) => within(path.relative(own, one))));
};
/** A file of the folder that is open with its whole path; the name of an installed plugin stays. */
const placed = (name) => {
  const file = path.resolve(vscode.workspace.workspaceFolders?.[0]?.uri.fsPath ?? "", name);
  return fs.existsSync(file) ? file : name;
};
let again; // tells the editor to ask once more for hints and lenses

/** One conversation with a server: numbered requests, their answers, and what it says of its own accord. */
class Connection {
  constructor(command, onEnd) {
    this.waiting = new Map();
    this.handlers = new Map();
    this.last = 0;
    this.heard = Buffer.alloc(0);
    this.process = spawn(command[0], command.slice(1), { stdio: ["pipe", "pipe", "pipe"] });
    this.process.on("error", onEnd);
    this.process.on("exit", () => this.end(new Error("the language server has ended")));
    this.process.stdin.on("error", () => {});
    this.process.stdout.on("data", (data) => this.hear(data));
  }

  end(error) {
    for (const { reject } of this.waiting.values()) reject(error);
    this.waiting.clear();
  }

  send(message) {
    const body = JSON.stringify({ jsonrpc: "2.0", ...message });
    if (this.process.stdin.writable)
      this.process.stdin.write(`Content-Length: ${Buffer.byteLength(body)}\r\n\r\n${body}`);
  }

  notify(method, params) {
    this.send({ method, params });
  }

  ask(method, params, token) {
    const id = ++this.last;
    token?.onCancellationRequested(() => this.notify("$/cancelRequest", { id }));
    return new Promise((resolve, reject) => {
      this.waiting.set(id, { resolve, reject });
      this.send({ id, method, params });
    });
  }

  hear(data) {
    this.heard = Buffer.concat([this.heard, data]);
    for (;;) {
      const end = this.heard.indexOf("\r\n\r\n");
      if (end < 0) return;
      const length = Number(/content-length: *(\d+)/i.exec(this.heard.toString("ascii", 0, end))[1]);
      if (this.heard.length < end + 4 + length) return;
      const message = JSON.parse(this.heard.toString("utf8", end + 4, end + 4 + length));
      this.heard = this.heard.subarray(end + 4 + length);
      this.take(message);
    }
  }

  async take(message) {
    if (message.method === undefined) {
      const asked = this.waiting.get(message.id);
      this.waiting.delete(message.id);
      if (message.error) asked?.reject(new Error(message.error.message));
      else asked?.resolve(message.result);
      return;
    }
    const handler = this.handlers.get(message.method);
    const result = handler ? await handler(message.params) : null;
    if (message.id !== undefined) this.send({ id: message.id, result: result ?? null });
  }
}

// ---------------------------------------------------------------- from the protocol to VS Code

const place = (p) => new vscode.Position(p.line, p.character);
const range = (r) => new vscode.Range(place(r.start), place(r.end));
const location = (l) =>
  new vscode.Location(vscode.Uri.parse(l.targetUri ?? l.uri), range(l.targetSelectionRange ?? l.range));
const locations = (found) => (found == null ? [] : [].concat(found).map(location));
const edit = (e) => new vscode.TextEdit(range(e.range), e.newText);
const command = (c) => c && { title: c.title, command: c.command, arguments: c.arguments };
const markdown = (c) => {
  const text = []
    .concat(c)
    .map((one) => (typeof one === "string" ? one : one.value))
    .join("\n\n");
  return new vscode.MarkdownString(text);
};

function changes(given) {
  if (!given) return undefined;
  const all = new vscode.WorkspaceEdit();
  for (const [uri, edits] of Object.entries(given.changes ?? {})) all.set(vscode.Uri.parse(uri), edits.map(edit));
  for (const one of given.documentChanges ?? []) all.set(vscode.Uri.parse(one.textDocument.uri), one.edits.map(edit));
  return all;
}

function diagnostic(d) {
  const found = new vscode.Diagnostic(range(d.range), d.message, (d.severity ?? 1) - 1);
  found.source = d.source;
  found.code = d.codeDescription ? { value: d.code, target: vscode.Uri.parse(d.codeDescription.href) } : d.code;
  found.tags = d.tags;
  found.relatedInformation = d.relatedInformation?.map(
    (r) => new vscode.DiagnosticRelatedInformation(location(r.location), r.message),
  );
  return Object.assign(found, { asSent: d });
}

function completion(item) {
  const found = new vscode.CompletionItem(item.label, (item.kind ?? 1) - 1);
  for (const name of ["detail", "sortText", "filterText", "preselect", "commitCharacters"]) found[name] = item[name];
  if (item.labelDetails) found.label = { label: item.label, ...item.labelDetails };
  if (item.documentation) found.documentation = markdown(item.documentation);
  const text = item.textEdit?.newText ?? item.insertText ?? item.label;
  found.insertText = item.insertTextFormat === 2 ? new vscode.SnippetString(text) : text;
  if (item.textEdit?.range) found.range = range(item.textEdit.range);
  found.additionalTextEdits = item.additionalTextEdits?.map(edit);
  found.command = command(item.command);
  return found;
}

function signatures(found) {
  if (!found) return undefined;
  const help = new vscode.SignatureHelp();
  help.activeSignature = found.activeSignature ?? 0;
  help.activeParameter = found.activeParameter ?? 0;
  help.signatures = found.signatures.map((s) => {
    const one = new vscode.SignatureInformation(s.label, s.documentation && markdown(s.documentation));
    const own = (p) => new vscode.ParameterInformation(p.label, p.documentation && markdown(p.documentation));
    one.parameters = (s.parameters ?? []).map(own);
    return one;
  });
  return help;
}

function symbol(s) {
  const found = new vscode.DocumentSymbol(
    s.name,
    s.detail ?? "",
    s.kind - 1,
    range(s.range),
    range(s.selectionRange),
  );
  found.children = (s.children ?? []).map(symbol);
  return found;
}

function hint(h) {
  const label = typeof h.label === "string" ? h.label : h.label.map((part) => part.value).join("");
  const found = new vscode.InlayHint(place(h.position), label, h.kind);
  found.paddingLeft = h.paddingLeft;
  found.paddingRight = h.paddingRight;
  if (h.tooltip) found.tooltip = markdown(h.tooltip);
  return found;
}

function action(a) {
  const found = new vscode.CodeAction(a.title, a.kind ? new vscode.CodeActionKind(a.kind) : undefined);
  found.edit = changes(a.edit);
  found.isPreferred = a.isPreferred;
  found.command = command(a.command);
  return found;
}

// ---------------------------------------------------------------- what the server is asked

const file = (document) => ({ textDocument: { uri: document.uri.toString() } });
const sent = (r) => ({ start: r.start, end: r.end }); // VS Code writes a range in another way
const at = (document, position) => ({ ...file(document), position });

/** What is registered where the server has the capability: its name, and a function that makes the provider. */
const PROVIDERS = {
  completionProvider: (server, can) =>
    vscode.languages.registerCompletionItemProvider(
      LANGUAGE,
      {
        provideCompletionItems: async (d, p, token) => {
          const found = await server.ask("textDocument/completion", at(d, p), token);
          return new vscode.CompletionList(
            (found?.items ?? found ?? []).map(completion),
            found?.isIncomplete ?? false,
          );
        },
      },
      ...(can.triggerCharacters ?? []),
    ),
  hoverProvider: (server) =>
    vscode.languages.registerHoverProvider(LANGUAGE, {
      provideHover: async (d, p, token) => {
        const found = await server.ask("textDocument/hover", at(d, p), token);
        return found && new vscode.Hover(markdown(found.contents), found.range && range(found.range));
      },
    }),
  signatureHelpProvider: (server, can) =>
    vscode.languages.registerSignatureHelpProvider(
      LANGUAGE,
      {
        provideSignatureHelp: async (d, p, token) =>
          signatures(await server.ask("textDocument/signatureHelp", at(d, p), token)),
      },
      ...(can.triggerCharacters ?? []),
    ),
  definitionProvider: (server) =>
    vscode.languages.registerDefinitionProvider(LANGUAGE, {
      provideDefinition: async (d, p, token) =>
        locations(await server.ask("textDocument/definition", at(d, p), token)),
    }),
  referencesProvider: (server) =>
    vscode.languages.registerReferenceProvider(LANGUAGE, {
      provideReferences: async (d, p, context, token) =>
        locations(await server.ask("textDocument/references", { ...at(d, p), context }, token)),
    }),
  renameProvider: (server) =>
    vscode.languages.registerRenameProvider(LANGUAGE, {
      provideRenameEdits: async (d, p, newName, token) =>
        changes(await server.ask("textDocument/rename", { ...at(d, p), newName }, token)),
    }),
  documentSymbolProvider: (server) =>
    vscode.languages.registerDocumentSymbolProvider(LANGUAGE, {
      provideDocumentSymbols: async (d, token) =>
        ((await server.ask("textDocument/documentSymbol", file(d), token)) ?? []).map(symbol),
    }),
  foldingRangeProvider: (server) =>
    vscode.languages.registerFoldingRangeProvider(LANGUAGE, {
      provideFoldingRanges: async (d, context, token) =>
        ((await server.ask("textDocument/foldingRange", file(d), token)) ?? []).map(
          (f) => new vscode.FoldingRange(f.startLine, f.endLine),
        ),
    }),
  documentFormattingProvider: (server) =>
    vscode.languages.registerDocumentFormattingEditProvider(LANGUAGE, {
      provideDocumentFormattingEdits: async (d, options, token) =>
        ((await server.ask("textDocument/formatting", { ...file(d), options }, token)) ?? []).map(edit),
    }),
  inlayHintProvider: (server) =>
    vscode.languages.registerInlayHintsProvider(LANGUAGE, {
      onDidChangeInlayHints: again.event,
      provideInlayHints: async (d, r, token) =>
        ((await server.ask("textDocument/inlayHint", { ...file(d), range: sent(r) }, token)) ?? []).map(hint),
    }),
  codeLensProvider: (server) =>
    vscode.languages.registerCodeLensProvider(LANGUAGE, {
      onDidChangeCodeLenses: again.event,
      provideCodeLenses: async (d, token) =>
        ((await server.ask("textDocument/codeLens", file(d), token)) ?? []).map(
          (l) => new vscode.CodeLens(range(l.range), command(l.command)),
        ),
    }),
  codeActionProvider: (server) =>
    vscode.languages.registerCodeActionsProvider(LANGUAGE, {
      provideCodeActions: async (d, r, context, token) => {
        const diagnostics = context.diagnostics.map(
          (one) => one.asSent ?? { range: sent(one.range), message: one.message },
        );
        return (
          (await server.ask(
            "textDocument/codeAction",
            { ...file(d), range: sent(r), context: { diagnostics } },
            token,
          )) ?? []
        ).map(action);
      },
    }),
  semanticTokensProvider: (server, can) =>
    vscode.languages.registerDocumentSemanticTokensProvider(
      LANGUAGE,
      {
        onDidChangeSemanticTokens: again.event,
        provideDocumentSemanticTokens: async (d, token) => {
          const found = await server.ask("textDocument/semanticTokens/full", file(d), token);
          return found && new vscode.SemanticTokens(new Uint32Array(found.data));
        },
      },
      new vscode.SemanticTokensLegend(can.legend.tokenTypes, can.legend.tokenModifiers),
    ),
};

/** Texts as they are opened, changed and closed; always whole, which every server takes. */
function follow(server) {
  const ours = (d) => d.languageId === LANGUAGE;
  const opened = (d) =>
    ours(d) &&
    server.notify("textDocument/didOpen", {
      textDocument: { uri: d.uri.toString(), languageId: LANGUAGE, version: d.version, text: d.getText() },
    });
  vscode.workspace.textDocuments.forEach(opened);
  return vscode.Disposable.from(
    vscode.workspace.onDidOpenTextDocument(opened),
    vscode.workspace.onDidChangeTextDocument(
      ({ document: d }) =>
        ours(d) &&
        server.notify("textDocument/didChange", {
          textDocument: { uri: d.uri.toString(), version: d.version },
          contentChanges: [{ text: d.getText() }],
        }),
    ),
    vscode.workspace.onDidSaveTextDocument((d) => ours(d) && server.notify("textDocument/didSave", file(d))),
    vscode.workspace.onDidCloseTextDocument((d) => ours(d) && server.notify("textDocument/didClose", file(d))),
  );
}

/** Files whose changes the server wants to be told of. */
function watch(server, context, registrations) {
  const changed = (type) => (uri) =>
    server.notify("workspace/didChangeWatchedFiles", { changes: [{ uri: uri.toString(), type }] });
  const wanted = registrations.filter((r) => r.method === "workspace/didChangeWatchedFiles");
  for (const { globPattern } of wanted.flatMap((r) => r.registerOptions.watchers)) {
    const watcher = vscode.workspace.createFileSystemWatcher(globPattern.pattern ?? globPattern);
    watcher.onDidCreate(changed(1));
    watcher.onDidChange(changed(2));
    watcher.onDidDelete(changed(3));
    context.subscriptions.push(watcher);
  }
}

/** `dsl run FILE ...` as a task, in a terminal that stays; of the scene that is open where no file is named. */
function perform(name, file, ...options) {
  const scene = file ?? vscode.window.activeTextEditor?.document.uri.fsPath;
  if (!scene) return undefined;
  const own = file ? [] : [].concat(plugins()); // to what the server offers it has put them
  const named = own.flatMap((one) => ["--plugin", placed(one)]);
  const words = [name, scene, ...options, ...named];
  const execution = new vscode.ProcessExecution(dsl(), words, { cwd: path.dirname(scene) });
  const title = [name, path.basename(scene), ...options].join(" ");
  const task = new vscode.Task({ type: "softmark", title }, vscode.TaskScope.Workspace, title, "dsl", execution);
  return vscode.tasks.executeTask(task);
}

let server;

async function activate(context) {
  again = new vscode.EventEmitter();
  for (const name of COMMANDS) {
    const run = (...given) => perform(name, ...given);
    context.subscriptions.push(vscode.commands.registerCommand(`softmark.${name}`, run));
  }
  context.subscriptions.push(vscode.tasks.onDidEndTask(() => again.fire()));
  const failed = (error) =>
    vscode.window.showErrorMessage(
      `softmark: \`${dsl()} lsp\` cannot be started (${error.message}). Install it with: ` +
        'pip install "softmark[lsp]", or say in the setting softmark.command where dsl is.',
    );
  server = new Connection([dsl(), "lsp"], failed);
  const log = vscode.window.createOutputChannel("softmark");
  let said = "";
  server.process.stderr.on("data", (data) => {
    said += data;
    log.append(String(data));
  });
  const found = vscode.languages.createDiagnosticCollection("softmark");
  server.handlers.set("textDocument/publishDiagnostics", (p) =>
    found.set(vscode.Uri.parse(p.uri), p.diagnostics.map(diagnostic)),
  );
  server.handlers.set("window/showMessage", (p) =>
    p.type <= 2 ? vscode.window.showWarningMessage(p.message) : vscode.window.showInformationMessage(p.message),
  );
  server.handlers.set("window/logMessage", (p) => log.appendLine(p.message));
  server.handlers.set("workspace/applyEdit", async (p) => ({
    applied: await vscode.workspace.applyEdit(changes(p.edit)),
  }));
  server.handlers.set("client/registerCapability", (p) => watch(server, context, p.registrations));
  for (const what of ["inlayHint", "codeLens", "semanticTokens"])
    server.handlers.set(`workspace/${what}/refresh`, () => again.fire());
  server.handlers.set("workspace/configuration", (p) => p.items.map(() => null));
  const folder = vscode.workspace.workspaceFolders?.[0]?.uri.toString() ?? null;
  const capabilities = {
    workspace: {
      applyEdit: true,
      didChangeWatchedFiles: { dynamicRegistration: true },
      inlayHint: { refreshSupport: true },
      codeLens: { refreshSupport: true },
      semanticTokens: { refreshSupport: true },
      didChangeConfiguration: {},
    },
    textDocument: {
      completion: {
        completionItem: { snippetSupport: true, documentationFormat: ["markdown"], labelDetailsSupport: true },
      },
      hover: { contentFormat: ["markdown"] },
      codeAction: { codeActionLiteralSupport: { codeActionKind: { valueSet: ["quickfix"] } } },
      documentSymbol: { hierarchicalDocumentSymbolSupport: true },
      publishDiagnostics: { relatedInformation: true },
      signatureHelp: { signatureInformation: { documentationFormat: ["markdown"] } },
      semanticTokens: { requests: { full: true }, formats: ["relative"], tokenTypes: [], tokenModifiers: [] },
      inlayHint: {},
      codeLens: {},
      definition: {},
      references: {},
      rename: {},
      formatting: {},
      foldingRange: {},
    },
  };
  let answer;
  try {
    answer = await server.ask("initialize", {
      processId: process.pid,
      rootUri: folder,
      capabilities,
      initializationOptions: { softmark: { plugins: plugins() } },
      workspaceFolders: folder ? [{ uri: folder, name: "workspace" }] : null,
    });
  } catch (error) {
    failed(new Error(said.trim() || error.message));
    return;
  }
  server.notify("initialized", {});
  for (const [name, provide] of Object.entries(PROVIDERS)) {
    const can = answer.capabilities[name];
    if (can) context.subscriptions.push(provide(server, can));
  }
  const configure = () =>
    server.notify("workspace/didChangeConfiguration", { settings: { softmark: { plugins: plugins() } } });
  context.subscriptions.push(
    vscode.workspace.onDidChangeConfiguration((e) => e.affectsConfiguration("softmark.plugins") && configure()),
    vscode.workspace.onDidGrantWorkspaceTrust(configure),
  );
  context.subscriptions.push(found, log, follow(server));
}

async function deactivate() {
  if (!server || server.process.exitCode !== null) return;
  await Promise.race([server.ask("shutdown").catch(() => {}), new Promise((done) => setTimeout(done, 1000))]);
  server.notify("exit");
}

module.exports = { activate, deactivate };
