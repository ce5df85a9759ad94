-- Shrinks a scene of random kernels (random_kernels.lua) while it keeps its fault.
--
--   shrink(made, is_faulty)     changes made; is_faulty() tests it in its current form
--
-- Removes kernels, functions and statements one by one, and replaces branches by their statements, until no single step
-- keeps the fault.

-- Returns all blocks of a tree.
local function blocks_of(part, found)
  if type(part) == "table" then
    if part.is_block then found[#found + 1] = part end
    for _, inner in ipairs(part) do blocks_of(inner, found) end
  end
  return found
end

-- Replaces list[k] by `items` if this keeps the fault.
local function replace(list, k, items, is_faulty)
  local before = { unpack(list) }
  table.remove(list, k)
  for place, item in ipairs(items) do table.insert(list, k + place - 1, item) end
  if is_faulty() then return true end
  for place = 1, math.max(#list, #before) do list[place] = before[place] end
  return false
end

local function shrink_list(list, is_faulty)
  local has_shrunk, k = false, #list
  while k >= 1 do
    local statement = list[k]
    if replace(list, k, {}, is_faulty) then
      has_shrunk = true
    elseif type(statement) == "table" and not statement.is_block then
      for _, part in ipairs(statement) do
        if type(part) == "table" and replace(list, k, part, is_faulty) then
          has_shrunk = true
          break
        end
      end
    end
    k = math.min(k - 1, #list)
  end
  return has_shrunk
end

return function(made, is_faulty)
  local has_shrunk
  repeat
    has_shrunk = shrink_list(made.kernels, is_faulty)
    has_shrunk = shrink_list(made.helpers, is_faulty) or has_shrunk
    local bodies = { made.helpers }
    for _, kernel in ipairs(made.kernels) do bodies[#bodies + 1] = kernel.body end
    for _, body in ipairs(bodies) do
      for _, list in ipairs(blocks_of(body, {})) do
        if list ~= made.helpers then has_shrunk = shrink_list(list, is_faulty) or has_shrunk end
      end
    end
  until not has_shrunk
end
