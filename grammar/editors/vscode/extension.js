// Starts the language server and shows the pictures that it makes beside the text.
const vscode = require('vscode');
const { LanguageClient } = require('vscode-languageclient/node');

let client;
let panel;

/** Shows the picture at an address; a number behind it makes the view read the file again. */
function show(uri) {
  const file = vscode.Uri.parse(uri);
  if (!panel) {
    panel = vscode.window.createWebviewPanel(
      'footlight.picture',
      'Footlight',
      { viewColumn: vscode.ViewColumn.Beside, preserveFocus: true },
    );
    panel.onDidDispose(() => { panel = undefined; });
  }
  // Another server has another folder.
  panel.webview.options = { localResourceRoots: [vscode.Uri.joinPath(file, '..')] };
  const source = `${panel.webview.asWebviewUri(file)}?${Date.now()}`;
  panel.webview.html = `<!doctype html><meta http-equiv="Content-Security-Policy"
    content="default-src 'none'; img-src ${panel.webview.cspSource}; style-src 'unsafe-inline'">
    <body style="margin:0;background:#111"><img src="${source}" alt="the light at the end of the cue"
    style="width:100%">`;
}

/** Makes a picture of the cue that the cursor is in: of the last one that begins above it. */
async function pictureHere() {
  const editor = vscode.window.activeTextEditor;
  if (editor?.document.languageId !== 'lxq') return;
  const { document, selection } = editor;
  const lenses = await vscode.commands.executeCommand(
    'vscode.executeCodeLensProvider', document.uri, Number.MAX_SAFE_INTEGER,
  ) ?? [];
  const above = lenses.filter((lens) => lens.command?.command === 'footlight.picture'
    && lens.range.start.line <= selection.active.line);
  const { command } = above.at(-1) ?? {};
  if (!command) {
    vscode.window.showInformationMessage(
      'Put the cursor into a cue of a show that has a stage and a view.',
    );
    return;
  }
  await vscode.commands.executeCommand(command.command, ...command.arguments);
}

/** Starts the server; says what to do where the program is not there. */
async function start(context) {
  const command = vscode.workspace.getConfiguration('footlight').get('path');
  client = new LanguageClient('footlight', 'Footlight', { command, args: ['lsp'] }, {
    documentSelector: [{ language: 'lxq' }],
    // Asked to open a picture in another program: it is beside the text already.
    middleware: { window: { showDocument: async () => ({ success: true }) } },
  });
  context.subscriptions.push(client);
  client.onNotification('footlight/picture', ({ uri }) => show(uri));
  try {
    await client.start();
  } catch (error) {
    const settings = 'Open Settings';
    const chosen = await vscode.window.showErrorMessage(
      `Footlight: \`${command}\` cannot be started (${error.message}). `
      + 'Install the program, or set `footlight.path` to where it is.',
      settings,
    );
    if (chosen === settings) {
      vscode.commands.executeCommand('workbench.action.openSettings', 'footlight.path');
    }
  }
}

async function activate(context) {
  context.subscriptions.push(
    vscode.commands.registerCommand('footlight.pictureHere', pictureHere),
  );
  if (vscode.workspace.isTrusted) {
    await start(context);
  } else {
    context.subscriptions.push(
      vscode.workspace.onDidGrantWorkspaceTrust(() => start(context)),
    );
  }
}

function deactivate() {
  return client?.stop();
}

module.exports = { activate, deactivate };
