-- Runs the command `rapid` and others for tests, and makes folders for their files.
--
--   local command = require "testing.command"
--   local folder = command.folder()                             removed at the end of the process
--   local result = command.rapid("run graph.lua -f 1-4", { cwd = folder.path })
--   result.status, result.stdout, result.stderr
local command = {}

-- Returns the string quoted as one word of the shell.
local function quoted(text)
  return "'" .. text:gsub("'", "'\\''") .. "'"
end
command.quoted = quoted

local function read(path)
  local file = io.open(path, "rb")
  if not file then return nil end
  local text = file:read "*a"
  file:close()
  return text
end

local Folder = {}
Folder.__index = Folder

-- Returns the path of a file in the folder.
function Folder:file(name)
  return self.path .. "/" .. name
end

-- Writes a file, and returns its path.
function Folder:write(name, text)
  local file = assert(io.open(self:file(name), "wb"))
  file:write(text)
  file:close()
  return self:file(name)
end

-- Returns the text of a file, or nil if it does not exist.
function Folder:read(name)
  return read(self:file(name))
end

-- Returns the names of all files below the folder, sorted, hidden ones included.
function Folder:list()
  local names = {}
  local pipe = assert(io.popen("cd " .. quoted(self.path) .. " && find . -type f | sed 's|^\\./||' | LC_ALL=C sort"))
  for name in pipe:lines() do names[#names + 1] = name end
  pipe:close()
  return names
end

-- Makes an empty folder. It is removed when the state closes, however the tests ended.
function command.folder()
  local pipe = assert(io.popen "mktemp -d")
  local path = pipe:read "*l"
  pipe:close()
  local folder = setmetatable({ path = path }, Folder)
  folder.remover = newproxy(true)
  getmetatable(folder.remover).__gc = function() os.execute("rm -rf " .. quoted(path)) end
  return folder
end

-- Runs a shell command; $RAPID is the command under test. options: cwd, a folder; environment, a table. The shell, or
-- the program that has replaced it, ends when this process does.
function command.shell(line, options)
  options = options or {}
  local out = command.folder()
  local setup = "cd " .. quoted(options.cwd or ".") .. "\nRAPID=" .. quoted(command.binary()) .. "\n"
  for name, value in pairs(options.environment or {}) do
    setup = setup .. ("export %s=%s\n"):format(name, quoted(value))
  end
  local script = out:write("script", setup .. line .. "\n")
  local status = os.execute(("exec setpriv --pdeathsig KILL sh %s >%s 2>%s </dev/null"):format(quoted(script),
    quoted(out:file "stdout"), quoted(out:file "stderr")))
  local signal = status % 256
  return {
    status = signal > 0 and 128 + signal or status / 256, stdout = out:read "stdout", stderr = out:read "stderr",
  }
end

-- Runs the command with arguments as the shell reads them.
function command.rapid(arguments, options)
  return command.shell('exec "$RAPID" ' .. arguments, options)
end

-- Returns the command under test: the one that runs the tests, or $RAPID_BIN.
function command.binary()
  return os.getenv "RAPID_BIN" or error("RAPID_BIN is not set; it must be the path of the command rapid", 0)
end

return command
