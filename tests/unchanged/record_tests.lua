-- Runs the test file UNCHANGED_TESTS, and writes the output of its scenes and commands to UNCHANGED_RECORD.
-- tests/unchanged/run runs it as a test, so the tests see the environment of `rapid test`.
--
-- Each record is a line of JSON: the test's name, the label, and the outputs by name. Points are written as a hash of
-- their bits per frame.
local command = require "testing.command"
local json = require "dkjson"
local bit = require "bit"
local ffi = require "ffi"
local rapid = require "rapid"

local path = assert(os.getenv "UNCHANGED_TESTS")
local record = assert(io.open(assert(os.getenv "UNCHANGED_RECORD"), "wb"))
local max_points = 2000 -- hashed one by one; of larger sets every nth, and the sums and bounds of all

local current = "outside of tests"

local function write(label, outputs)
  record:write(json.encode { test = current, label = label, outputs = outputs }, "\n")
  record:flush()
end

local function read(file_path)
  local file = io.open(file_path, "rb")
  if not file then return nil end
  local text = file:read "*a"
  file:close()
  return text
end

local bits = ffi.new "union { double number; uint64_t whole; }"
local function mixed(hash, number)
  bits.number = number
  hash = bit.bxor(hash, bits.whole) * 0x9e3779b97f4a7c15ULL
  return bit.bxor(hash, bit.rshift(hash, 31))
end

local function mixed_text(hash, text)
  for i = 1, #text do hash = mixed(hash, text:byte(i)) end
  return mixed(hash, #text)
end

-- Hashes a value by its components: a number, a vec3 or a quat.
local function mixed_value(hash, value, kind)
  if kind == "number" then return mixed(hash, value) end
  hash = mixed(mixed(mixed(hash, value.x), value.y), value.z)
  return kind == "quat" and mixed(hash, value.w) or hash
end

local function kind_of(value)
  return type(value) == "number" and "number" or tostring(value):match "^%a+"
end

local function hash_of(points)
  local count = #points
  local step = math.max(1, math.floor(count / max_points))
  local hash = mixed(14695981039346656037ULL, count)
  for _, name in ipairs(points:names()) do
    hash = mixed_text(hash, name)
    for _, reduce in ipairs(count > 0 and { "min", "max", "mean" } or {}) do
      local value = points[reduce](points, name)
      hash = mixed_value(hash, value, kind_of(value))
    end
    local kind = count > 0 and kind_of(points[1][name])
    for i = 1, count, step do hash = mixed_value(hash, points[i][name], kind) end
  end
  for _, name in ipairs(points:groups()) do
    hash = mixed_text(hash, name)
    for i = 1, count, step do hash = mixed(hash, points[i]:within(name) and 1 or 0) end
  end
  return ("%d points, %s"):format(count, bit.tohex(hash, 16))
end

local function text_of(value)
  if type(value) ~= "table" then return tostring(value) end
  local words = {}
  for name, member in pairs(value) do words[#words + 1] = tostring(name) .. " = " .. text_of(member) end
  table.sort(words) -- LuaJIT's order of names differs between processes
  return "{ " .. table.concat(words, ", ") .. " }"
end

-- Returns a label for a run. Many tests iterate over tables in no particular order, so the position does not identify
-- it.
local function label_of(scene, options)
  return ("%s %s\n%s"):format(tostring(scene), text_of(options), type(scene) == "string" and read(scene) or "")
end

local run = rapid.run
function rapid.run(scene, options)
  local label = label_of(scene, options)
  local ok, result = pcall(run, scene, options)
  if not ok then
    write(label, { error = tostring(result) })
    error(result, 0)
  end
  local outputs = { warnings = table.concat(result.warnings, "\n") }
  for _, name in ipairs(result.outputs) do
    for frame, points in result:output(name):frames() do
      outputs[("%s frame %04d"):format(name, frame)] = hash_of(points)
    end
  end
  write(label, outputs)
  return result
end

-- Returns the files that a command wrote into its folder; points, pictures and long files as hashes. Pictures of a
-- study are skipped, because they show times.
local function files_of(folder, stamp, outputs)
  local pipe = io.popen(("cd %s && find . -type f -newer %s ! -name '*.svg' | LC_ALL=C sort")
    :format(command.quoted(folder), command.quoted(stamp)))
  for name in pipe:lines() do
    local text = read(folder .. "/" .. name)
    -- OpenVDB writes a random UUID after the header of a level set's file.
    if text and name:match "%.vdb$" then text = text:sub(1, 21) .. text:sub(58) end
    if text and (#text > 50000 or name:match "%.csv$" or text:find "[%z\1-\8]") then
      text = ("%d bytes, %s"):format(#text, bit.tohex(mixed_text(14695981039346656037ULL, text), 16))
    end
    outputs["file " .. name] = text
  end
  pipe:close()
end

local stamps = command.folder()
local shell = command.shell
function command.shell(line, options)
  local stamp = stamps:write("stamp", "")
  local result = shell(line, options)
  if line:find "RAPID" then
    local outputs = { status = tostring(result.status), stdout = result.stdout, stderr = result.stderr }
    local folder = options and options.cwd
    if folder and folder:match "^/tmp/" then files_of(folder, stamp, outputs) end
    write(line, outputs)
  end
  return result
end

-- A replacement of `it` that records the name of the running test.
local environment = setmetatable({}, { __index = getfenv(1) })
function environment.it(name, body)
  return it(name, body and function(...)
    current = name
    return body(...)
  end)
end

local tests = assert(loadfile(path))
setfenv(tests, environment)()
