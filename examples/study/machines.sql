-- Do machines disagree? Sessions with several fingerprints for the same contents, index, camera and pace. `osp study check`
-- asks the same (and more) without DuckDB. No row: all agree.
SELECT any_value(file) AS file, file_hash, index, camera, pace,
       count(DISTINCT fingerprint) AS fingerprints,
       list(DISTINCT fingerprint || ' on ' || host || ' (' || simd || ', ' || osp_commit || ')') AS seen
FROM 'results.ndjson'
WHERE error IS NULL AND frames_fingerprinted = frames
GROUP BY file_hash, index, camera, pace, lenient, max_polygons
HAVING count(DISTINCT fingerprint) > 1
ORDER BY file, index;
