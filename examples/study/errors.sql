-- Sessions with an error or with remarks: for example a file that ends in the middle of a line, or skipped pieces.
SELECT DISTINCT file, host, error, remarks, skipped
FROM sessions
WHERE error IS NOT NULL OR len(remarks) > 0 OR skipped > 0
ORDER BY error IS NULL, file, host;
