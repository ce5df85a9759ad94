-- rapid run --events: births, contacts and deaths as points with their positions and times.
local scene = require "testing.scene"
local csv_rows = require "tests.csv_rows"

local g = 9.81

local function events_of(text, frames)
  local result = scene.command("run", text, "-f 1-" .. frames .. " --quiet --events events.csv")
  assert.equal(0, result.status, result.stderr)
  local of = { [0] = {}, {}, {} }
  for _, row in ipairs(csv_rows(scene.folder:read "events.csv")) do table.insert(of[row.event], row) end
  return of
end

describe("--events", function()
  it("has the contacts of a ball, and its end", function()
    local of = events_of([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 1, 0}}, v = {{2, 0, 0}}, life = {1.7},
    mass = {3} } }
  :gravity {} :collide { shape = rapid.shape.plane {}, bounce = 0.5 } :solve {}]], 60)
    assert.equal(1, #of[0])
    assert.equal(0, of[0][1].time)
    local fall = math.sqrt(2 / g)
    local t, speed = fall, g * fall
    for k = 1, 3 do
      local hit = of[1][k]
      assert.near(t, hit.time, 2e-6)
      assert.near(2 * t, hit.Px, 1e-5)
      assert.near(0, hit.Py, 1e-6)
      assert.near(speed, hit.speed, 1e-5)
      assert.near(3 * 1.5 * speed, hit.impulse, 1e-4)
      assert.near(0.5 * speed, hit.vy, 1e-5)
      assert.equal(1, hit.Ny)
      assert.equal(0, hit.hitpath)
      assert.equal(math.ceil(t * 24) + 1, hit.frame)
      speed = 0.5 * speed
      t = t + 2 * speed / g
    end
    assert.equal(1, #of[2])
    assert.near(1.7, of[2][1].time, 1e-6)
    assert.near(3.4, of[2][1].Px, 1e-5)
  end)

  it("has all births of a stream at their moments, in each sub-frame", function()
    local of = events_of([[
return rapid.create { fps = 24, subframes = 2 }
  :emit { source = rapid.points.from { P = {{0, 0, 0}} }, rate = 100, birth = "even", life = 0.25 } :solve {}]], 13)
    assert.equal(50, #of[0])
    assert.equal(25, #of[2])
    for k = 1, 50 do assert.near(k / 100, of[0][k].time, 2e-6) end
    for k = 1, 25 do assert.near(k / 100 + 0.25, of[2][k].time, 2e-6) end
  end)

  it("changes no byte of the frames", function()
    local text = [[
return rapid.create { fps = 24 }
  :emit { source = rapid.mesh.sphere { center = {0, 2, 0} }, rate = 500, life = {0.1, 0.6}, velocity = {0, -3, 0} }
  :gravity {} :collide { shape = rapid.shape.plane {}, response = "die" } :solve { substeps = 2 }]]
    for _, more in ipairs { "-o a.####.bgeo", "-o b.####.bgeo --events events.bgeo" } do
      assert.equal(0, scene.command("run", text, "-f 1-12 --quiet " .. more).status)
    end
    local read = function(name) return assert(io.open(scene.folder.path .. "/" .. name, "rb")):read "*a" end
    assert.is_true(#read "events.bgeo" > 1000)
    for frame = 1, 12 do
      assert.is_true(read(("a.%04d.bgeo"):format(frame)) == read(("b.%04d.bgeo"):format(frame)))
    end
  end)

  it("keeps no events: they are on their way to the disk", function()
    local text = [[
return rapid.create { fps = 24 }
  :emit { source = rapid.mesh.sphere { center = {0, 2, 0} }, rate = 1e5, life = {0.01, 0.02} } :solve {}]]
    for _, extension in ipairs { "csv", "bgeo" } do
      local peak, rows = {}, {}
      for i, frames in ipairs { 20, 200 } do
        local result = scene.command("run", text, ("-f 1-%d --threads 2 --events e.%s"):format(frames, extension))
        assert.equal("", result.stderr)
        peak[i] = tonumber(result.stdout:match "([%d.]+) MiB of memory")
        rows[i] = #scene.folder:read("e." .. extension)
      end
      -- 1,600,000 events, of 68 bytes in .bgeo
      assert.truthy(rows[2] > 1e8 and rows[2] > 9 * rows[1], rows[2])
      assert.truthy(peak[2] - peak[1] < 10, ("%g MiB after 20 frames, %g after 200"):format(peak[1], peak[2]))
    end
  end)

  it("are a whole file, or none where the run fails", function()
    local text = [[
return rapid.create { fps = 24 } :emit { source = rapid.mesh.sphere {}, rate = 500 }
  :detail("fail", function(points, frame) if frame.number == 5 then error "late" end end) :solve {}]]
    scene.folder:write("e.csv", "old")
    assert.equal(1, scene.command("run", text, "-f 1-8 --quiet --events e.csv").status)
    assert.equal("old", scene.folder:read "e.csv")
    assert.equal(0, scene.command("run", text, "-f 1-4 --quiet --events e.csv").status)
    assert.match("^id,Px,Py,Pz,", scene.folder:read "e.csv")
    local full = scene.command("run", text, "-f 1-4 --quiet --events /dev/full/e.csv")
    assert.equal(2, full.status)
    assert.match("/dev/full/e%.csv: ", full.stderr)
  end)

  it("refuses a file that holds no points", function()
    local result = scene.command("run", "return rapid.create {} :solve {}", "-f 1-2 --events events.json")
    assert.equal(2, result.status)
    assert.match("use one of [%.%w, ]*%.csv, [%.%w, ]*%.vtp", result.stderr)
  end)
end)
