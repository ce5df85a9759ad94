-- rapid trace: the lives of points, against closed forms.
local scene = require "testing.scene"

local g = 9.81

local function trace(text, arguments)
  return scene.command("trace", text, "--json " .. arguments)
end

-- Returns the lines of a life, as text.
local function reported(text, arguments, status)
  local result = scene.command("trace", text, arguments)
  assert.equal(status or 0, result.status, result.stderr)
  return result.stdout, result.stderr
end

local function numbers_in(line)
  local numbers = {}
  for word in line:gmatch "%-?[%d.]+e?[-+]?%d*" do numbers[#numbers + 1] = tonumber(word) end
  return numbers
end

local ball = [[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 1, 0}, {5, 1, 0}}, v = {{2, 0, 0}, {0, 0, 0}},
    life = {1, 9}, mass = {3, 3} } }
  :gravity {} :collide { name = "floor", shape = rapid.shape.plane {}, bounce = 0.5 } :solve {}]]

describe("trace", function()
  it("lists birth, contacts and the end of a ball's life at their times", function()
    local text = reported(ball, "--id 0 -f 1-60")
    assert.truthy(text:find("born in create1 at (0, 1, 0), v = (2, 0, 0)", 1, true), text)
    local fall, contacts = math.sqrt(2 / g), {}
    for line in text:gmatch "[^\n]+" do
      if line:find "meets floor" then contacts[#contacts + 1] = numbers_in(line) end
    end
    assert.is_true(#contacts >= 1)
    assert.near(fall, contacts[1][2], 1e-5) -- frame, time, position, normal, speed, impulse
    assert.near(2 * fall, contacts[1][3], 1e-5)
    assert.near(g * fall, contacts[1][9], 1e-4)
    assert.near(3 * 1.5 * g * fall, contacts[1][10], 1e-3)
    local death = text:match "([^\n]+its life ended)"
    assert.near(1, numbers_in(death)[2], 1e-6)
    assert.falsy(text:find("point 1 ", 1, true))
  end)

  it("lists each force with its node, in metres per second squared", function()
    local text = reported([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{2, 0, 0}}, v = {{0, 3, 0}} } }
  :gravity {} :spring { stiffness = 2 } :drag { linear = 4 } :solve {}]], "--id 0 -f 1-2")
    local gravity = numbers_in(text:match "gravity1 accelerates it by ([^\n]+) m/s")
    assert.same({0, -9.81, 0}, gravity)
    local drag = numbers_in(text:match "drag1 accelerates it by ([^\n]+) m/s")
    assert.same({0, -12, 0}, drag)
    local spring = numbers_in(text:match "spring1 accelerates it by ([^\n]+) m/s")
    assert.near(-4, spring[1], 1e-6)
  end)

  it("lists the changes of each node, and the one that removed the point", function()
    local text = reported([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0, 0}}, v = {{0, 1, 0}} } }
  :attribute { heat = 0 }
  :points("warm", function(p) p.heat = p.heat + 2 end)
  :points("cull", function(p) if p.heat > 5 then p:kill() end end)
  :solve {}]], "--id 0 -f 1-9")
    assert.truthy(text:find("warm: heat 0 -> 2", 1, true), text)
    assert.truthy(text:find("warm: heat 2 -> 4", 1, true), text)
    assert.truthy(text:find("removed by cull", 1, true), text)
  end)

  it("names the collider that kills", function()
    local text = reported([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 1, 0}} } }
  :gravity {} :collide { name = "lava", shape = rapid.shape.plane {}, response = "die" } :solve {}]], "--id 0 -f 1-24")
    local death = text:match "([^\n]+killed by contact with lava)"
    assert.near(math.sqrt(2 / g), numbers_in(death)[2], 1e-5)
  end)

  it("changes no byte of the values: those of run", function()
    local result = trace(ball, "--id 1 -f 7")
    assert.equal(0, result.status, result.stderr)
    assert.equal(0, scene.command("run", ball, "-f 7 -o p.####.csv --quiet").status)
    local rows = require "tests.csv_rows"(scene.folder:read "p.0007.csv")
    local y = tonumber(result.stdout:match [["values":{.-"P":%[[^,]+,([^,]+),]])
    assert.near(rows[2].Py, y, 1e-9)
  end)

  it("says where no point has the id, and refuses a create that there is not", function()
    local _, errors = reported(ball, "--id 77", 1)
    assert.truthy(errors:find("no point up to frame 48 has the id 77", 1, true))
    local result = scene.command("trace", ball, "--id 0 --of creat1")
    assert.equal(2, result.status)
    assert.truthy(result.stderr:find("did you mean", 1, true), result.stderr)
  end)
end)
