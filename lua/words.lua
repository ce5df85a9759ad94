-- Values in messages. Graph code reads messages too (pcall), so no address may be in one.
local words = {}

-- "nil", "a number", "a table"
function words.article(value)
  return value == nil and "nil" or "a " .. type(value)
end

-- A value as it is written, where it is short; any other by its type.
function words.value(value)
  local kind = type(value)
  if kind == "string" then return ("%q"):format(value) end
  if kind == "number" or kind == "cdata" or kind == "boolean" then return tostring(value) end
  return words.article(value)
end

-- What was used as a name.
function words.name(value)
  return type(value) == "string" and value or words.value(value)
end

return words
