// osp for C#: one file, to be compiled with a program, over the C library of bindings/c (osp_c.dll, libosp_c.so,
// libosp_c.dylib). Needs /unsafe and Span<T>: .NET Standard 2.1, .NET 5 and newer, Unity 2021.2 and newer (C# 9), Mono 6.8.
// The language is kept to C# 7.0. What the functions do, and what may run at once, is said in bindings/c/include/osp.h.
using System;
using System.Runtime.InteropServices;
using Microsoft.Win32.SafeHandles;

namespace OspCulling
{
    /// <summary>Why a call was refused.</summary>
    public enum OspStatus
    {
        Ok = 0,
        BufferTooSmall = 1,
        NullPointer = 2,
        MisalignedPointer = 3,
        TooMany = 4,
        InvalidBox = 5,
        InvalidTriangle = 6,
        UnknownId = 7,
        InvalidView = 8,
        InvalidArgument = 9,
        NotCommitted = 10,
        Busy = 11,
        Poisoned = 12,
        Internal = 13
    }

    /// <summary>Which depths a matrix gives, after the division by w. Unity's Camera.projectionMatrix is MinusOneToOne.</summary>
    public enum OspDepth
    {
        ZeroToOne = 0,
        MinusOneToOne = 1
    }

    /// <summary>How a scene finds what is hidden.</summary>
    public enum OspOcclusion
    {
        None = 0,
        Msvbsp = 1,
        Depth = 2,
        DepthLast = 3,
        Auto = 4
    }

    /// <summary>Whether a ray looks for what it hits first, or for anything.</summary>
    public enum OspRayMode
    {
        Nearest = 0,
        Any = 1
    }

    /// <summary>A box in world space: its smallest and largest corner.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct OspBox
    {
        public float MinX, MinY, MinZ, MaxX, MaxY, MaxZ;

        public OspBox(float minX, float minY, float minZ, float maxX, float maxY, float maxZ)
        {
            MinX = minX;
            MinY = minY;
            MinZ = minZ;
            MaxX = maxX;
            MaxY = maxY;
            MaxZ = maxZ;
        }
    }

    /// <summary>What a ray hits: Id is Osp.NoId for nothing; T is in units of the direction's length.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct OspHit
    {
        public uint Id;
        public float T;

        public bool IsHit
        {
            get { return Id != Osp.NoId; }
        }
    }

    /// <summary>Hints: a cube around most of what will come, and boxes to reserve memory for.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct OspIndexConfig
    {
        public float RootX, RootY, RootZ, RootSize;
        public uint Capacity;
    }

    /// <summary>Hints, a method, and what it costs to draw one box or triangle, nanoseconds.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct OspSceneConfig
    {
        public OspIndexConfig Index;
        public OspOcclusion Occlusion;
        public float DrawNs;
    }

    /// <summary>What a frame has found, for all its views together.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct OspFrame
    {
        public ulong Count, InView, Visible, Occluders, InsertNs, CullNs, OcclusionNs;
    }

    /// <summary>A call that was refused; it has changed nothing. The message is the library's.</summary>
    public sealed class OspException : Exception
    {
        public OspStatus Status { get; private set; }

        public OspException(OspStatus status, string message) : base(message)
        {
            Status = status;
        }
    }

    /// <summary>Constants, and the version of the library that is loaded.</summary>
    public static class Osp
    {
        public const uint NoId = uint.MaxValue;
        public const int MaxIds = 1 << 27;
        public const int MaxViews = 64;
        /// <summary>The version that this file is for: major * 65536 + minor * 256 + patch.</summary>
        public const uint Version = 256;

        public static uint LibraryVersion
        {
            get { return Native.osp_version(); }
        }

        internal static void Check(OspStatus status)
        {
            if (status != OspStatus.Ok)
            {
                throw new OspException(status, Marshal.PtrToStringAnsi(Native.osp_last_error()));
            }
        }

        /// <summary>Whether all ids found room; throws for every other refusal.</summary>
        internal static bool HadRoom(OspStatus status)
        {
            if (status == OspStatus.BufferTooSmall)
            {
                return false;
            }
            Check(status);
            return true;
        }

        internal static void Length(int found, int expected, string name)
        {
            if (found != expected)
            {
                throw new ArgumentException("expected " + expected + " values, found " + found, name);
            }
        }

        internal static void Grow(ref uint[] ids, int count)
        {
            if (ids.Length < count)
            {
                ids = new uint[Math.Max(count, Math.Min(2 * (long)ids.Length, MaxIds))];
            }
        }

        internal static void CheckVersion()
        {
            if (LibraryVersion >> 8 != Version >> 8)
            {
                throw new OspException(OspStatus.InvalidArgument, "expected version " + (Version >> 16) + "." + (Version >> 8 & 255)
                    + " of osp_c, found " + (LibraryVersion >> 16) + "." + (LibraryVersion >> 8 & 255));
            }
        }
    }

    /// <summary>An index of boxes: they come, move and go at any time, and each view finds those that it may see.</summary>
    public sealed unsafe class OspIndex : IDisposable
    {
        readonly IndexHandle handle = new IndexHandle();

        public OspIndex()
        {
            Osp.CheckVersion();
            IntPtr made;
            Osp.Check(Native.osp_index_new(null, out made));
            handle.Take(made);
        }

        public OspIndex(OspIndexConfig config)
        {
            Osp.CheckVersion();
            IntPtr made;
            Osp.Check(Native.osp_index_new(&config, out made));
            handle.Take(made);
        }

        /// <summary>Frees it, as soon as no call is running.</summary>
        public void Dispose()
        {
            handle.Dispose();
        }

        /// <summary>Boxes in the index.</summary>
        public int Count
        {
            get
            {
                UIntPtr count;
                Osp.Check(Native.osp_index_count(handle, out count));
                return (int)count;
            }
        }

        /// <summary>Memory that it holds, bytes.</summary>
        public long Memory
        {
            get
            {
                UIntPtr bytes;
                Osp.Check(Native.osp_index_memory(handle, out bytes));
                return (long)bytes;
            }
        }

        /// <summary>Inserts a box and gives it an id.</summary>
        public uint Insert(OspBox box)
        {
            uint id;
            Osp.Check(Native.osp_index_insert(handle, &box, (UIntPtr)1, &id));
            return id;
        }

        /// <summary>Inserts boxes, all or none; ids is as long.</summary>
        public void Insert(ReadOnlySpan<OspBox> boxes, Span<uint> ids)
        {
            Osp.Length(ids.Length, boxes.Length, "ids");
            fixed (OspBox* from = &MemoryMarshal.GetReference(boxes))
            fixed (uint* to = &MemoryMarshal.GetReference(ids))
            {
                Osp.Check(Native.osp_index_insert(handle, from, (UIntPtr)boxes.Length, to));
            }
        }

        /// <summary>Moves a box.</summary>
        public void Update(uint id, OspBox box)
        {
            Osp.Check(Native.osp_index_update(handle, &id, &box, (UIntPtr)1));
        }

        /// <summary>Moves boxes, all or none; ids and boxes are of one length.</summary>
        public void Update(ReadOnlySpan<uint> ids, ReadOnlySpan<OspBox> boxes)
        {
            Osp.Length(ids.Length, boxes.Length, "ids");
            fixed (uint* whose = &MemoryMarshal.GetReference(ids))
            fixed (OspBox* from = &MemoryMarshal.GetReference(boxes))
            {
                Osp.Check(Native.osp_index_update(handle, whose, from, (UIntPtr)boxes.Length));
            }
        }

        /// <summary>Takes a box out.</summary>
        public void Remove(uint id)
        {
            Osp.Check(Native.osp_index_remove(handle, id));
        }

        /// <summary>Takes everything out.</summary>
        public void Clear()
        {
            Osp.Check(Native.osp_index_clear(handle));
        }

        /// <summary>Ends a batch of changes: once a frame, before the queries.</summary>
        public void Commit()
        {
            Osp.Check(Native.osp_index_commit(handle));
        }

        /// <summary>The box with an id.</summary>
        public OspBox Box(uint id)
        {
            OspBox box;
            Osp.Check(Native.osp_index_box(handle, id, out box));
            return box;
        }

        /// <summary>The boxes that a view may see, ascending. clipFromWorld: sixteen numbers, column after column. False if there
        /// are more than ids holds: then nothing is in it, and count says how many.</summary>
        public bool Frustum(ReadOnlySpan<float> clipFromWorld, OspDepth depth, Span<uint> ids, out int count)
        {
            Osp.Length(clipFromWorld.Length, 16, "clipFromWorld");
            fixed (float* matrix = &MemoryMarshal.GetReference(clipFromWorld))
            fixed (uint* to = &MemoryMarshal.GetReference(ids))
            {
                UIntPtr found;
                OspStatus status = Native.osp_index_frustum(handle, matrix, (int)depth, to, (UIntPtr)ids.Length, out found);
                count = (int)found;
                return Osp.HadRoom(status);
            }
        }

        /// <summary>The boxes that a view may see, in an array that grows where it has to; how many.</summary>
        public int Frustum(ReadOnlySpan<float> clipFromWorld, OspDepth depth, ref uint[] ids)
        {
            int count;
            ids = ids ?? Array.Empty<uint>();
            // Another thread may change the index in between.
            while (!Frustum(clipFromWorld, depth, ids, out count))
            {
                Osp.Grow(ref ids, count);
            }
            return count;
        }

        /// <summary>The boxes behind none of six planes a b c d.</summary>
        public bool FrustumOfPlanes(ReadOnlySpan<float> planes, Span<uint> ids, out int count)
        {
            Osp.Length(planes.Length, 24, "planes");
            fixed (float* numbers = &MemoryMarshal.GetReference(planes))
            fixed (uint* to = &MemoryMarshal.GetReference(ids))
            {
                UIntPtr found;
                OspStatus status = Native.osp_index_frustum_of_planes(handle, numbers, to, (UIntPtr)ids.Length, out found);
                count = (int)found;
                return Osp.HadRoom(status);
            }
        }

        /// <summary>The boxes that share a point with a box.</summary>
        public bool BoxQuery(OspBox box, Span<uint> ids, out int count)
        {
            fixed (uint* to = &MemoryMarshal.GetReference(ids))
            {
                UIntPtr found;
                OspStatus status = Native.osp_index_box_query(handle, &box, to, (UIntPtr)ids.Length, out found);
                count = (int)found;
                return Osp.HadRoom(status);
            }
        }

        /// <summary>The boxes that share a point with a ball.</summary>
        public bool SphereQuery(float x, float y, float z, float radius, Span<uint> ids, out int count)
        {
            float* center = stackalloc float[3];
            center[0] = x;
            center[1] = y;
            center[2] = z;
            fixed (uint* to = &MemoryMarshal.GetReference(ids))
            {
                UIntPtr found;
                OspStatus status = Native.osp_index_sphere_query(handle, center, radius, to, (UIntPtr)ids.Length, out found);
                count = (int)found;
                return Osp.HadRoom(status);
            }
        }

        /// <summary>A box that a ray enters at t up to tMax. origin and direction are x y z.</summary>
        public OspHit Ray(ReadOnlySpan<float> origin, ReadOnlySpan<float> direction, float tMax, OspRayMode mode)
        {
            Osp.Length(origin.Length, 3, "origin");
            Osp.Length(direction.Length, 3, "direction");
            fixed (float* from = &MemoryMarshal.GetReference(origin))
            fixed (float* along = &MemoryMarshal.GetReference(direction))
            {
                OspHit hit;
                Osp.Check(Native.osp_index_ray(handle, from, along, tMax, (int)mode, out hit));
                return hit;
            }
        }
    }

    /// <summary>A scene of boxes and triangles. Opaque triangles hide what is behind them; boxes stand for meshes.</summary>
    public sealed unsafe class OspScene : IDisposable
    {
        readonly SceneHandle handle = new SceneHandle();

        public OspScene(OspSceneConfig config)
        {
            Osp.CheckVersion();
            IntPtr made;
            Osp.Check(Native.osp_scene_new(&config, out made));
            handle.Take(made);
        }

        /// <summary>Frees it, as soon as no call is running.</summary>
        public void Dispose()
        {
            handle.Dispose();
        }

        /// <summary>Boxes and triangles in the scene.</summary>
        public int Count
        {
            get
            {
                UIntPtr count;
                Osp.Check(Native.osp_scene_count(handle, out count));
                return (int)count;
            }
        }

        /// <summary>Memory of the boxes, the triangles and their index, bytes.</summary>
        public long Memory
        {
            get
            {
                UIntPtr bytes;
                Osp.Check(Native.osp_scene_memory(handle, out bytes));
                return (long)bytes;
            }
        }

        /// <summary>Inserts a box, which hides nothing, and gives it an id.</summary>
        public uint InsertBox(OspBox box)
        {
            uint id;
            Osp.Check(Native.osp_scene_insert_boxes(handle, &box, (UIntPtr)1, &id));
            return id;
        }

        /// <summary>Inserts triangles, all or none: three numbers for each vertex, three indices and an id for each triangle. With
        /// no indices the vertices are taken in their order.</summary>
        public void InsertTriangles(ReadOnlySpan<float> vertices, ReadOnlySpan<uint> indices, bool isOpaque, Span<uint> ids)
        {
            if (vertices.Length % 3 != 0)
            {
                throw new ArgumentException("expected three numbers for each vertex, found " + vertices.Length, "vertices");
            }
            if (indices.Length > 0)
            {
                Osp.Length(indices.Length, checked(3 * ids.Length), "indices");
            }
            fixed (float* numbers = &MemoryMarshal.GetReference(vertices))
            fixed (uint* places = &MemoryMarshal.GetReference(indices))
            fixed (uint* to = &MemoryMarshal.GetReference(ids))
            {
                uint* listed = indices.Length > 0 ? places : null;
                Osp.Check(Native.osp_scene_insert_triangles(handle, numbers, (UIntPtr)(vertices.Length / 3), listed,
                    (UIntPtr)ids.Length, isOpaque ? 1 : 0, to));
            }
        }

        /// <summary>Moves a box.</summary>
        public void UpdateBox(uint id, OspBox box)
        {
            Osp.Check(Native.osp_scene_update_box(handle, id, &box));
        }

        /// <summary>Moves a triangle: nine numbers.</summary>
        public void UpdateTriangle(uint id, ReadOnlySpan<float> corners)
        {
            Osp.Length(corners.Length, 9, "corners");
            fixed (float* numbers = &MemoryMarshal.GetReference(corners))
            {
                Osp.Check(Native.osp_scene_update_triangle(handle, id, numbers));
            }
        }

        /// <summary>Takes a box or a triangle out.</summary>
        public void Remove(uint id)
        {
            Osp.Check(Native.osp_scene_remove(handle, id));
        }

        /// <summary>Takes the changes over without culling, for queries between frames.</summary>
        public void Commit()
        {
            Osp.Check(Native.osp_scene_commit(handle));
        }

        /// <summary>A frame: takes the changes over and culls each view. Sixteen numbers for each view, perspectives only.</summary>
        public OspFrame Frame(ReadOnlySpan<float> clipFromWorld, OspDepth depth)
        {
            if (clipFromWorld.Length == 0 || clipFromWorld.Length % 16 != 0)
            {
                throw new ArgumentException("expected 16 values for each view, found " + clipFromWorld.Length, "clipFromWorld");
            }
            fixed (float* matrices = &MemoryMarshal.GetReference(clipFromWorld))
            {
                OspFrame frame;
                Osp.Check(Native.osp_scene_frame(handle, matrices, (UIntPtr)(clipFromWorld.Length / 16), (int)depth, out frame));
                return frame;
            }
        }

        /// <summary>What to draw of a view of the last frame, ascending. False if there are more than ids holds.</summary>
        public bool Visible(int view, Span<uint> ids, out int count)
        {
            fixed (uint* to = &MemoryMarshal.GetReference(ids))
            {
                UIntPtr found;
                OspStatus status =
                    Native.osp_scene_visible(handle, unchecked((uint)view), to, (UIntPtr)ids.Length, out found);
                count = (int)found;
                return Osp.HadRoom(status);
            }
        }

        /// <summary>What to draw of a view, in an array that grows where it has to; how many.</summary>
        public int Visible(int view, ref uint[] ids)
        {
            int count;
            ids = ids ?? Array.Empty<uint>();
            while (!Visible(view, ids, out count))
            {
                Osp.Grow(ref ids, count);
            }
            return count;
        }

        /// <summary>What lies in the frustum of any projection, hidden or not.</summary>
        public bool Frustum(ReadOnlySpan<float> clipFromWorld, OspDepth depth, Span<uint> ids, out int count)
        {
            Osp.Length(clipFromWorld.Length, 16, "clipFromWorld");
            fixed (float* matrix = &MemoryMarshal.GetReference(clipFromWorld))
            fixed (uint* to = &MemoryMarshal.GetReference(ids))
            {
                UIntPtr found;
                OspStatus status = Native.osp_scene_frustum(handle, matrix, (int)depth, to, (UIntPtr)ids.Length, out found);
                count = (int)found;
                return Osp.HadRoom(status);
            }
        }

        /// <summary>What shares a point with a box, triangles by their boxes.</summary>
        public bool BoxQuery(OspBox box, Span<uint> ids, out int count)
        {
            fixed (uint* to = &MemoryMarshal.GetReference(ids))
            {
                UIntPtr found;
                OspStatus status = Native.osp_scene_box_query(handle, &box, to, (UIntPtr)ids.Length, out found);
                count = (int)found;
                return Osp.HadRoom(status);
            }
        }

        /// <summary>Where a ray enters a box or meets a triangle, at t up to tMax. origin and direction are x y z.</summary>
        public OspHit Ray(ReadOnlySpan<float> origin, ReadOnlySpan<float> direction, float tMax, OspRayMode mode)
        {
            Osp.Length(origin.Length, 3, "origin");
            Osp.Length(direction.Length, 3, "direction");
            fixed (float* from = &MemoryMarshal.GetReference(origin))
            fixed (float* along = &MemoryMarshal.GetReference(direction))
            {
                OspHit hit;
                Osp.Check(Native.osp_scene_ray(handle, from, along, tMax, (int)mode, out hit));
                return hit;
            }
        }
    }

    sealed class IndexHandle : SafeHandleZeroOrMinusOneIsInvalid
    {
        internal IndexHandle() : base(true)
        {
        }

        internal void Take(IntPtr made)
        {
            SetHandle(made);
        }

        protected override bool ReleaseHandle()
        {
            return Native.osp_index_free(handle) == OspStatus.Ok;
        }
    }

    sealed class SceneHandle : SafeHandleZeroOrMinusOneIsInvalid
    {
        internal SceneHandle() : base(true)
        {
        }

        internal void Take(IntPtr made)
        {
            SetHandle(made);
        }

        protected override bool ReleaseHandle()
        {
            return Native.osp_scene_free(handle) == OspStatus.Ok;
        }
    }

    static unsafe class Native
    {
#if UNITY_IOS && !UNITY_EDITOR
        const string Library = "__Internal";
#else
        const string Library = "osp_c";
#endif
        const CallingConvention C = CallingConvention.Cdecl;

        [DllImport(Library, CallingConvention = C)]
        internal static extern IntPtr osp_last_error();

        [DllImport(Library, CallingConvention = C)]
        internal static extern uint osp_version();

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_index_new(OspIndexConfig* config, out IntPtr index);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_index_free(IntPtr index);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_index_insert(IndexHandle index, OspBox* boxes, UIntPtr count, uint* ids);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_index_update(IndexHandle index, uint* ids, OspBox* boxes, UIntPtr count);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_index_remove(IndexHandle index, uint id);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_index_clear(IndexHandle index);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_index_commit(IndexHandle index);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_index_count(IndexHandle index, out UIntPtr count);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_index_memory(IndexHandle index, out UIntPtr bytes);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_index_box(IndexHandle index, uint id, out OspBox bounds);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_index_frustum(
            IndexHandle index, float* clipFromWorld, int depth, uint* ids, UIntPtr room, out UIntPtr count);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_index_frustum_of_planes(
            IndexHandle index, float* planes, uint* ids, UIntPtr room, out UIntPtr count);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_index_box_query(
            IndexHandle index, OspBox* bounds, uint* ids, UIntPtr room, out UIntPtr count);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_index_sphere_query(
            IndexHandle index, float* center, float radius, uint* ids, UIntPtr room, out UIntPtr count);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_index_ray(
            IndexHandle index, float* origin, float* direction, float tMax, int mode, out OspHit hit);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_scene_new(OspSceneConfig* config, out IntPtr scene);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_scene_free(IntPtr scene);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_scene_insert_boxes(SceneHandle scene, OspBox* boxes, UIntPtr count, uint* ids);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_scene_insert_triangles(SceneHandle scene, float* vertices, UIntPtr vertexCount,
            uint* indices, UIntPtr triangleCount, int isOpaque, uint* ids);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_scene_update_box(SceneHandle scene, uint id, OspBox* bounds);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_scene_update_triangle(SceneHandle scene, uint id, float* corners);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_scene_remove(SceneHandle scene, uint id);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_scene_count(SceneHandle scene, out UIntPtr count);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_scene_memory(SceneHandle scene, out UIntPtr bytes);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_scene_commit(SceneHandle scene);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_scene_frame(
            SceneHandle scene, float* clipFromWorld, UIntPtr viewCount, int depth, out OspFrame frame);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_scene_visible(
            SceneHandle scene, uint view, uint* ids, UIntPtr room, out UIntPtr count);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_scene_frustum(
            SceneHandle scene, float* clipFromWorld, int depth, uint* ids, UIntPtr room, out UIntPtr count);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_scene_box_query(
            SceneHandle scene, OspBox* bounds, uint* ids, UIntPtr room, out UIntPtr count);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_scene_ray(
            SceneHandle scene, float* origin, float* direction, float tMax, int mode, out OspHit hit);
    }
}
