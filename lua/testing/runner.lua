-- Runs one file of tests in busted's language, and tells the host of each test.
--
-- busted's own command line is not used: output, search for files and exit status are those of `rapid test`.
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

-- The names of the enclosing describe blocks and of the test itself.
local function full_name(element)
  local names = {}
  while element and element.descriptor ~= "file" and (element.name or element.descriptor) do
    table.insert(names, 1, tostring(element.name or element.descriptor))
    element = busted.context.parent(element)
  end
  return #names > 0 and table.concat(names, " ") or path
end

local message -- of the running test, once something is wrong with it
local tests = 0 -- started; the first `already_run` of them did so in an earlier process of this file

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

-- In a test the message is kept until the test ends. A file or a describe block that does not run hides its tests. A
-- failure before or after tests (before_each, setup, ...) is reported by itself.
local function failed(element, _, text, trace)
  -- An error of a scene names the scene's file: the test's own line comes before it.
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
if not body then return end -- told of by `failed`
busted.executors.file(path, setmetatable({ getTrace = get_trace }, { __call = body }))
require "busted.execute" (busted) (1, {})
