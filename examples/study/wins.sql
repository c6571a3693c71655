-- The fastest index of each session (by the median time of a frame), and its number of wins.
-- An index that was too slow for every frame (--budget) does not compete.
WITH ranked AS (
    SELECT file, host, polygons, index, frame_us.p50 AS frame_p50_us,
           row_number() OVER (PARTITION BY file, file_hash, host, options, osp_commit ORDER BY frame_us.p50, index) AS place
    FROM runs
    WHERE occlusion IS NULL AND frames > 0 AND frames_fingerprinted = frames
)
SELECT file, host, polygons, index AS least_time, round(frame_p50_us, 2) AS frame_p50_us,
       count(*) OVER (PARTITION BY index) AS sessions_won_by_it
FROM ranked
WHERE place = 1
ORDER BY file, host;
