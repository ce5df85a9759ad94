-- Runs one file of tests in busted's language, and reports each test to the host.
--
-- busted's own command line is not used: output, file search and exit status are those of `rapid test`.
local native, path, filter, already_run = ...

local ok, busted = pcall(function()
  return require "busted.core" ()
end)
if not ok then
  error("rapid test needs busted (on Debian: apt install lua-busted); " .. tostring(busted), 0)
end
require "busted" (busted)
require "busted.luajit" ()

local rapid = require "testing.rapid" (native)
package.preload.rapid = function() return rapid end
rawset(_G, "rapid", rapid)
rawset(_G, "vec3", require("vec3").make)
rawset(_G, "quat", require("vec3").make_quat)
require "testing.assertions" (native)

-- Returns the names of the enclosing describe blocks and of the test itself.
local function full_name(element)
  local names = {}
  while element and element.descriptor ~= "file" and (element.name or element.descriptor) do
    table.insert(names, 1, tostring(element.name or element.descriptor))
    element = busted.context.parent(element)
  end
  return #names > 0 and table.concat(names, " ") or path
end

local message -- of the running test, once it has failed
local tests = 0 -- tests started; the first `already_run` of them ran in an earlier process of this file

busted.subscribe({ "test", "start" }, function(element)
  message = nil
  tests = tests + 1
  if tests > already_run then
    native.tell("started", full_name(element))
  else
    element.run = function() end
  end
  return nil, true
end)

busted.subscribe({ "test", "end" }, function(element, _, status)
  if tests <= already_run then return nil, true end
  local kind = status == "success" and "passed" or status == "pending" and "skipped" or "failed"
  native.tell(kind, full_name(element), kind == "failed" and (message or "no message") or nil)
  message = nil
  return nil, true
end)

-- During a test the message is stored until the test ends. A file or a describe block that does not run hides its
-- tests. A failure before or after tests (before_each, setup, ...) is reported separately.
local function failed(element, _, text, trace)
  -- An error of a scene names the scene's file, so the test's own line is put before it.
  if not text:find(path .. ":", 1, true) then
    local _, place = tostring(trace and trace.traceback):find(path .. ":", 1, true)
    local line = place and trace.traceback:match("^%d+", place + 1)
    if line then text = ("%s:%s: %s"):format(path, line, text) end
  end
  if element.descriptor == "it" then
    message = message or text
  elseif element.descriptor == "file" or element.descriptor == "describe" then
    native.tell("broken", full_name(element), text)
  else
    native.tell("failed", full_name(element), text)
  end
  return nil, true
end
busted.subscribe({ "failure" }, failed)
busted.subscribe({ "error" }, failed)

require "busted.modules.filter_loader" () (busted, { filter = filter ~= "" and { filter } or {}, nokeepgoing = false })

local body, get_trace = require("busted.modules.files.lua").load(busted, path)
if not body then return end -- reported by `failed`
busted.executors.file(path, setmetatable({ getTrace = get_trace }, { __call = body }))
require "busted.execute" (busted) (1, {})
