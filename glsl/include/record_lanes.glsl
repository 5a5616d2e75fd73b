// Invocations that gather at one cache point; as Tuning::record_groups in src/gpu/tuning.rs.
const uint RECORD_GROUP = 64u;  // of a workgroup
layout(constant_id = 10) const uint RECORD_LANES = 1u;
const uint RECORDS = RECORD_GROUP / RECORD_LANES;  // of a workgroup
