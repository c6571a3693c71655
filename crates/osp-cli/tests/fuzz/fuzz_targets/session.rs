#![no_main]
osp_fuzz::fuzz!(session);
