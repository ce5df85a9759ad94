-- Sequences of files: behaviour beyond their ends, and before they begin.
local scene = require "testing.scene"

-- A flat square at the height y(file), files `first` to `last`.
local function write_squares(name, first, last, y)
  for file = first, last do
    local h = y(file)
    scene.folder:write(("%s.%04d.obj"):format(name, file),
      ("v 0 %.9g 0\nv 1 %.9g 0\nv 1 %.9g 1\nv 0 %.9g 1\nf 4 3 2 1\n"):format(h, h, h, h))
  end
end

-- Returns the file for a frame, by counting.
local function file_of(frame, first, last, how, offset)
  local file = frame - offset
  if file >= first and file <= last then return file end
  local beyond = file < first and how.before or how.after
  if beyond == "hold" then return file < first and first or last end
  if beyond == "none" then return nil end
  local order = {}
  for k = first, last do order[#order + 1] = k end
  if beyond == "mirror" then for k = last - 1, first + 1, -1 do order[#order + 1] = k end end
  return order[(file - first) % #order + 1]
end

local ways = { "hold", "repeat", "mirror", "none" }

describe("a sequence of meshes", function()
  it("has the file of each frame that counting gives, with any before, after and offset", function()
    write_squares("flat", 3, 6, function(file) return 10 * file end)
    for _, before in ipairs(ways) do
      for _, after in ipairs(ways) do
        for _, offset in ipairs { -2, 0, 5 } do
          local result = scene.run(([[
return rapid.create { fps = 24 }
  :emit { source = rapid.mesh.read("flat.####.obj", { before = %q, after = %q, offset = %d }), count = 3,
          motion = "none", birth = "end", life = 0.03 } :solve {}]])
            :format(before, after, offset), { frames = {2, 16} })
          for frame = 2, 16 do
            local how = { before = before, after = after }
            local file = file_of(frame, 3, 6, how, offset)
            -- A source that is missing at either end of a frame emits nothing in it.
            if not file_of(frame - 1, 3, 6, how, offset) then file = nil end
            local points = result[frame]
            assert.equal(file and 3 or 0, #points, ("%s %s %d frame %d"):format(before, after, offset, frame))
            for i = 1, #points do assert.near(10 * file, points[i].P.y, 1e-5) end
          end
        end
      end
    end
  end)

  it("is one motion over its ends where it goes round: births follow the spline", function()
    -- A sine of 8 files continues smoothly into its repetition.
    write_squares("wave", 1, 8, function(file) return math.sin(2 * math.pi * file / 8) end)
    write_squares("long", 1, 32, function(file) return math.sin(2 * math.pi * file / 8) end)
    local function run(read)
      return scene.run(([[
return rapid.create { fps = 24, seed = 3 } :emit { source = %s, count = 20, life = 0.06, cut = {} } :solve {}]])
        :format(read), { frames = {4, 28} })
    end
    local round = run [[rapid.mesh.read("wave.####.obj", { after = "repeat", before = "repeat" })]]
    local long = run [[rapid.mesh.read "long.####.obj"]]
    for frame = 4, 28 do assert.same_points(long[frame], round[frame]) end
  end)

  it("is a collider only where it has files", function()
    local function box(file)
      local lines = {}
      for corner = 0, 7 do
        local x, y, z = corner % 2, math.floor(corner / 2) % 2, math.floor(corner / 4)
        lines[#lines + 1] = ("v %g %g %g"):format(2 * x - 1, 0.4 * y - 0.4, 2 * z - 1)
      end
      for _, face in ipairs { "1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6" } do
        lines[#lines + 1] = "f " .. face
      end
      scene.folder:write(("box.%04d.obj"):format(file), table.concat(lines, "\n") .. "\n")
    end
    for file = 1, 12 do box(file) end
    local function height(after)
      return scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0.1, 0}} } } :gravity {}
  :collide { shape = rapid.levelset.from_mesh(rapid.mesh.read("box.####.obj", { after = %q }), { voxel = 0.05 }),
             bounce = 0 } :solve {}]]):format(after), { frames = {1, 24} })
    end
    local held, gone = height "hold", height "none"
    assert.near(0, held[24][1].P.y, 1e-4)
    assert.near(0, gone[12][1].P.y, 1e-4)
    -- It falls from the frame on in which the box has disappeared.
    local t = 12 / 24
    assert.near(-0.5 * 9.81 * t * t, gone[24][1].P.y, 1e-4)
  end)

  it("reports wrong arguments", function()
    write_squares("flat", 1, 3, function() return 0 end)
    local function message(read)
      return scene.error(("return rapid.create {} :emit { source = %s, count = 1 } :solve {}"):format(read))
    end
    assert.matches('before = "backwards" is unknown; it must be one of hold, repeat, mirror, none',
      message [[rapid.mesh.read("flat.####.obj", { before = "backwards" })]], 1, true)
    assert.matches("offset = 0.5 is not whole", message [[rapid.mesh.read("flat.####.obj", { offset = 0.5 })]], 1, true)
    assert.matches('after needs a sequence of files, but "flat.0001.obj" is one file',
      message [[rapid.mesh.read("flat.0001.obj", { after = "hold" })]], 1, true)
  end)
end)

describe("a sequence of level sets", function()
  it("has the file of each frame by its number, and nothing for a missing file", function()
    for file = 3, 6 do
      local made = scene.command("run", ([[
local ball = rapid.levelset.sphere { radius = 0.2, center = {%d, 0, 0}, voxel = 0.05 }:write("ball.%04d.vdb")
return rapid.create { points = two } :solve {}]]):format(file, file), "-f 1 --quiet")
      assert.equal(0, made.status, made.stderr)
    end
    for _, how in ipairs { { "hold", "repeat" }, { "mirror", "none" }, { "none", "mirror" } } do
      -- Points at x = 1 to 9 die in the current ball.
      local result = scene.run(([[
local ball = rapid.levelset.read("ball.####.vdb", { before = %q, after = %q, offset = 1 })
return rapid.create { fps = 24 }
  :emit { source = rapid.points.grid { size = {9, 0, 0}, spacing = 1, center = {5, 0, 0} }, count = 9, birth = "end",
          life = 0.03 }
  :collide { shape = ball, response = "die" } :solve {}]]):format(how[1], how[2]), { frames = {2, 14} })
      for frame = 2, 14 do
        local file = file_of(frame, 3, 6, { before = how[1], after = how[2] }, 1)
        local there = {}
        for i = 1, #result[frame] do there[result[frame][i].P.x] = true end
        for x = 1, 9 do assert.equal(x ~= file, there[x] == true, ("%s %s %d: %d"):format(how[1], how[2], frame, x)) end
      end
    end
  end)
end)

describe("a sequence of points", function()
  local function write_points(first, last, name)
    for file = first, last do
      scene.folder:write(("%s.%04d.csv"):format(name or "set", file),
        ("id,Px,Py,Pz,heat\n7,%d,0,0,2\n9,%d,1,0,3\n"):format(file, file))
    end
  end

  it("has the file of each frame that counting gives", function()
    write_points(3, 6)
    for _, before in ipairs(ways) do
      for _, after in ipairs(ways) do
        local result = scene.run(([[
return rapid.create { fps = 24 }
  :emit { source = rapid.points.read("set.####.csv", { before = %q, after = %q, offset = 1 }), count = 2,
          motion = "none", birth = "end", life = 0.03 } :solve {}]]):format(before, after), { frames = {2, 16} })
        for frame = 2, 16 do
          local file = file_of(frame, 3, 6, { before = before, after = after }, 1)
          local points = result[frame]
          assert.equal(file and 2 or 0, #points, ("%s %s frame %d"):format(before, after, frame))
          for i = 1, #points do
            assert.near(file, points[i].P.x, 1e-6)
            assert.near(points[i].P.y + 2, points[i].heat, 1e-6)
          end
        end
      end
    end
  end)

  it("emits along the path from file to file, by ids", function()
    write_points(1, 8)
    local points = scene.run([[
return rapid.create { fps = 24 }
  :emit { source = rapid.points.read "set.####.csv", rate = 4800, birth = "even", inherit_velocity = 0 }
  :solve {}]], { frames = {5, 5} })[5]
    -- Half of the births belong to each point, at any position between the files 1 and 5.
    assert.equal(800, #points)
    for _, y in ipairs { 0, 1 } do
      local lowest, highest = 99, -99
      for i = 1, #points do
        if points[i].P.y == y then
          lowest, highest = math.min(lowest, points[i].P.x), math.max(highest, points[i].P.x)
        end
      end
      assert.is_true(lowest < 1.1 and highest > 4.8, ("from %g to %g"):format(lowest, highest))
    end
  end)

  it("is a function of the frame for others, too", function()
    write_points(1, 3, "few")
    local points = scene.run([[
local set = rapid.points.read("few.####.csv", { after = "repeat" })
return rapid.create { fps = 24 } :emit { source = function(frame) return set { number = frame.number + 3 } end,
  count = 2, motion = "none", birth = "end", life = 0.03 } :solve {}]], { frames = {2, 2} })[2]
    assert.near(2, points[1].P.x, 1e-6)
  end)

  it("reports wrong arguments", function()
    local function message(read)
      return scene.error(("return rapid.create {} :emit { source = %s, count = 1 } :solve {}"):format(read))
    end
    assert.matches('there is no file ".*nothing%.####%.csv" at any frame',
      message [[rapid.points.read "nothing.####.csv"]])
    write_points(1, 2)
    scene.folder:write("gap.0001.csv", "id,Px,Py,Pz\n1,0,0,0\n")
    scene.folder:write("gap.0004.csv", "id,Px,Py,Pz\n1,0,0,0\n")
    assert.matches("frame 2 of .* is missing; each frame from 1 to 4 needs a file",
      message [[rapid.points.read "gap.####.csv"]])
    assert.matches("offset needs a sequence of files", message [[rapid.points.read("set.0001.csv", { offset = 1 })]],
      1, true)
  end)
end)
