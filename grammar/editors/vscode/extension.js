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

async function activate(context) {
  const command = vscode.workspace.getConfiguration('footlight').get('path');
  client = new LanguageClient('footlight', 'Footlight', { command, args: ['lsp'] }, {
    documentSelector: [{ language: 'lxq' }],
    // Asked to open a picture in another program: it is beside the text already.
    middleware: { window: { showDocument: async () => ({ success: true }) } },
  });
  context.subscriptions.push(client);
  client.onNotification('footlight/picture', ({ uri }) => show(uri));
  await client.start();
}

function deactivate() {
  return client?.stop();
}

module.exports = { activate, deactivate };
