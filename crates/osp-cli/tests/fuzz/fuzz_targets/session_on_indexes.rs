#![no_main]
osp_fuzz::fuzz!(session_on_indexes);
