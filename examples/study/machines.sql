-- Do machines, builds or indexes disagree? Lists sessions with different fingerprints for the same contents, camera, pace and limits.
-- With occlusion culling, also compares the drawn polygons, for the same index, method and options. No rows: all agree.
WITH seen AS (
    SELECT *, regexp_extract(options, '--max-polygons (\d+)', 1) AS max_polygons, contains(options, '--lenient') AS lenient
    FROM runs
    WHERE frames_fingerprinted = frames
), answers AS (
    SELECT *, '' AS culled_by, fingerprint AS answer FROM seen
    UNION ALL
    SELECT *, concat_ws(' ', index, occlusion, options), drawn_fingerprint FROM seen WHERE drawn_fingerprint IS NOT NULL
)
SELECT any_value(file) AS file, file_hash, camera, pace, culled_by, count(DISTINCT answer) AS fingerprints,
       list(DISTINCT concat(answer, ' by ', index, ' on ', host, ' (', simd, ', ', osp_commit, ')')) AS seen
FROM answers
GROUP BY file_hash, camera, pace, lenient, max_polygons, culled_by
HAVING count(DISTINCT answer) > 1
ORDER BY file, culled_by;
