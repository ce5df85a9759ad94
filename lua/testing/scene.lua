-- Runs scenes given as strings.
--
--   local scene = require "testing.scene"
--   local result = scene.run("return rapid.create { points = two } :solve {}", { frames = {1, 4} })
--   local message = scene.error "return rapid.create {} :gravty {}"
--
-- A scene begins with `rapid` and `two`, a set of the points (0, 1, 0) and (1, 1, 0), both at rest. Its text begins in
-- line 1 of scene.lua. Messages leave out its folder.
local command = require "testing.command"

local scene = {}
local rapid = require "rapid" -- the module of tests

local head = [[local rapid = require "rapid" ; local two = rapid.points.from { P = {{0, 1, 0}, {1, 1, 0}} } ; ]]

-- The folder of this test file's scenes: scene.folder:write(name, text) puts a module next to them.
scene.folder = command.folder()

function scene.write(text)
  return scene.folder:write("scene.lua", head .. text)
end

-- options: as in rapid.run; frames 1 to 3 by default.
function scene.run(text, options)
  local given = { frames = {1, 3} }
  for name, value in pairs(options or {}) do given[name] = value end
  return rapid.run(scene.write(text), given)
end

-- Returns the message of a run that must fail.
function scene.error(text, options)
  local ok, message = pcall(scene.run, text, options)
  if ok then error("the scene ran, but an error was expected:\n" .. text, 2) end
  return (message:gsub(scene.folder.path:gsub("%W", "%%%0") .. "/", ""))
end

-- Runs a command of `rapid` on the scene, in a process of its own: scene.command("run", text, "-f 1-4").
function scene.command(name, text, arguments, options)
  scene.write(text)
  options = options or {}
  options.cwd = scene.folder.path
  return command.rapid(("%s scene.lua %s"):format(name, arguments or ""), options)
end

-- Returns the points of frame 2 after a kernel with this body, function(p, frame), has edited `two`.
--   columns: further columns, "heat = {1, 2}"; before: text in front of the graph, of one line.
function scene.kernel(body, columns, before)
  return scene.run(scene.kernel_text(body, columns, before), { frames = {2, 2} })[2]
end

-- Returns the message of a kernel that must fail. Its body is in line 2.
function scene.kernel_error(body, columns, before)
  return scene.error(scene.kernel_text(body, columns, before), { frames = {2, 2} })
end

function scene.kernel_text(body, columns, before)
  local points = ("rapid.points.from { P = {{0, 1, 0}, {1, 1, 0}}, %s }"):format(columns or "")
  return ([[
%s return rapid.create { points = %s } :points("kernel", function(p, frame)
  %s
end) :solve {}]]):format(before or "", points, body)
end

return scene
