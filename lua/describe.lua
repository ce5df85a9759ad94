-- Values in messages. Graph code reads messages too (pcall), so no address may be in one.
local describe = {}

-- "nil", "a number", "a table"
function describe.kind(value)
  return value == nil and "nil" or "a " .. type(value)
end

-- A value as it is written, where it is short; any other by its type.
function describe.value(value)
  local kind = type(value)
  if kind == "string" then return ("%q"):format(value) end
  if kind == "number" or kind == "cdata" or kind == "boolean" then return tostring(value) end
  return describe.kind(value)
end

-- The same, of a value that a formula is given: a number or a vec3 as it is written.
function describe.operand(value)
  local kind = type(value)
  if kind == "number" or kind == "cdata" then return tostring(value) end
  return describe.kind(value)
end

-- A value that was used as a name.
function describe.name(value)
  return type(value) == "string" and value or describe.value(value)
end

return describe
