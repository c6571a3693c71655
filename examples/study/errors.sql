-- Sessions with an error, with remarks of the reader, or with skipped pieces: for example a file that ends in the middle of a line.
SELECT DISTINCT file, host, error, remarks, skipped
FROM sessions
WHERE error IS NOT NULL OR len(remarks) > 0 OR skipped > 0
ORDER BY error IS NULL, file, host;
