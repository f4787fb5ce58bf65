-- A client as people have it: opens a show, waits for what is told, mends it by the offered fix,
-- formats it, and writes down what it was told.
local folder = vim.env.FOLDER
local told = {}
vim.cmd('edit ' .. folder .. '/show.lxq')
local buffer = vim.api.nvim_get_current_buf()
local id = vim.lsp.start_client { name = 'footlight', cmd = { vim.env.FOOTLIGHT, 'lsp' }, root_dir = folder }
vim.lsp.buf_attach_client(buffer, id)

local function diagnostics(count)
  vim.wait(20000, function() return #vim.diagnostic.get(buffer) == count end, 10)
  return vim.diagnostic.get(buffer)
end

local function ask(method, params)
  local answers = vim.lsp.buf_request_sync(buffer, method, params, 20000)
  return answers and answers[id] and answers[id].result
end

local document = { uri = vim.uri_from_bufnr(buffer) }
local found = diagnostics(1)
told.message, told.line, told.column = found[1].message, found[1].lnum, found[1].col
local range = {
  start = { line = found[1].lnum, character = 0 },
  ['end'] = { line = found[1].lnum, character = 40 },
}
local fixes = ask('textDocument/codeAction',
  { textDocument = document, range = range, context = { diagnostics = {} } })
told.fix = fixes[1].title
vim.lsp.util.apply_workspace_edit(fixes[1].edit, 'utf-16')
told.left = #diagnostics(0)
local hover = ask('textDocument/hover', { textDocument = document, position = { line = 2, character = 6 } })
told.hover = hover.contents.value
local edits = ask('textDocument/formatting',
  { textDocument = document, options = { tabSize = 2, insertSpaces = true } })
vim.lsp.util.apply_text_edits(edits, buffer, 'utf-16')
vim.cmd('write')
local out = assert(io.open(folder .. '/told.json', 'w'))
out:write(vim.fn.json_encode(told))
out:close()
vim.lsp.stop_client(id)
vim.cmd('qall!')
