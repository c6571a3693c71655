// osp for C#: one file, to be compiled with a program, on top of the C library of bindings/c (osp_c.dll, libosp_c.so,
// libosp_c.dylib). Needs /unsafe and Span<T>: .NET Standard 2.1, .NET 5 and newer, Unity 2021.2 and newer (C# 9), Mono 6.8.
// The language is kept to C# 7.0. bindings/c/include/osp.h describes the functions, and the calls that may run at the same time.
using System;
using System.Runtime.InteropServices;
using Microsoft.Win32.SafeHandles;

namespace OspCulling
{
    /// <summary>The reason why a call was refused.</summary>
    public enum OspStatus
    {
        Ok = 0,
        BufferTooSmall = 1,
        NullPointer = 2,
        MisalignedPointer = 3,
        TooMany = 4,
        InvalidCamera = 5,
        InvalidOccluder = 6,
        InvalidArgument = 7,
        UnknownKey = 8,
        Busy = 9,
        Poisoned = 10,
        Internal = 11
    }

    /// <summary>Range of depths of a matrix in clip space, after the division by w. Unity's Camera.projectionMatrix is MinusOneToOne.</summary>
    public enum OspDepth
    {
        ZeroToOne = 0,
        OneToZero = 1,
        MinusOneToOne = 2
    }

    /// <summary>The reason why an object, or its occluder, was refused.</summary>
    public enum OspRefusal
    {
        Bounds = 0,
        Key = 1,
        Occluder = 2
    }

    /// <summary>A box in world space, by its smallest and largest corner.</summary>
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

    /// <summary>An object whose box a ray enters at T lengths of the direction, or that is T metres from a point. T is 0 if the start or
    /// the point is inside.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct OspHit
    {
        public ulong Key;
        public float T;
    }

    /// <summary>Numbers of objects for a camera: objects to draw, and objects in view that occluders hide.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct OspSeen
    {
        readonly UIntPtr visible, hidden;

        public int Visible
        {
            get { return (int)visible; }
        }

        public int Hidden
        {
            get { return (int)hidden; }
        }
    }

    /// <summary>An object whose box or occluder was refused, with the reason.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct OspRefused
    {
        public ulong Key;
        public OspRefusal Why;
    }

    /// <summary>A camera or a light. By default it sees all layers, and occluders hide nothing.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct OspCamera
    {
        fixed double clipFromWorld[16];
        int depth, hideByOccluders;
        /// <summary>Mask of the layers that the camera sees, with a bit for each layer.</summary>
        public uint Layers;

        /// <summary>Makes a camera from the matrix of any projection: sixteen numbers from world to clip space, in column-major
        /// order.</summary>
        public OspCamera(ReadOnlySpan<float> clipFromWorld, OspDepth depth)
        {
            Osp.Length(clipFromWorld.Length, 16, "clipFromWorld");
            fixed (float* matrix = &MemoryMarshal.GetReference(clipFromWorld))
            {
                Osp.Check(Native.osp_camera_f32(matrix, (int)depth, out this));
            }
        }

        /// <summary>Makes a camera from a matrix of 64-bit numbers. Use it for an eye far from the origin.</summary>
        public OspCamera(ReadOnlySpan<double> clipFromWorld, OspDepth depth)
        {
            Osp.Length(clipFromWorld.Length, 16, "clipFromWorld");
            fixed (double* matrix = &MemoryMarshal.GetReference(clipFromWorld))
            {
                Osp.Check(Native.osp_camera_f64(matrix, (int)depth, out this));
            }
        }

        /// <summary>Whether the results omit objects behind occluders.</summary>
        public bool HideByOccluders
        {
            get { return hideByOccluders != 0; }
            set { hideByOccluders = value ? 1 : 0; }
        }

        /// <summary>Computes the ray through a point of the screen. x and y are from -1 to 1. origin and direction get three numbers
        /// each.</summary>
        public void Ray(float x, float y, Span<float> origin, Span<float> direction)
        {
            Osp.Length(origin.Length, 3, "origin");
            Osp.Length(direction.Length, 3, "direction");
            OspCamera camera = this;
            fixed (float* from = &MemoryMarshal.GetReference(origin))
            fixed (float* along = &MemoryMarshal.GetReference(direction))
            {
                Osp.Check(Native.osp_camera_ray(&camera, x, y, from, along));
            }
        }
    }

    /// <summary>A call that was refused and has changed nothing. The message comes from the library.</summary>
    public sealed class OspException : Exception
    {
        public OspStatus Status { get; private set; }

        public OspException(OspStatus status, string message) : base(message)
        {
            Status = status;
        }
    }

    /// <summary>Constants, and the version of the loaded library.</summary>
    public static class Osp
    {
        public const int MaxObjects = 1 << 27;
        public const int MaxCameras = 64;
        public const uint AllLayers = uint.MaxValue;
        /// <summary>The library version that this file requires: major * 65536 + minor * 256 + patch.</summary>
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

        /// <summary>Whether there was room for all values. Throws for every other refusal.</summary>
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

        internal static void Grow<T>(ref T[] values, int count)
        {
            if (values.Length < count)
            {
                values = new T[Math.Max(count, Math.Min(2 * (long)values.Length, MaxObjects))];
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

    /// <summary>Finds the objects that cameras see. Objects can be added, moved and removed at any time. Each has a key of your choice, and a box.</summary>
    public sealed unsafe class OspCuller : IDisposable
    {
        readonly CullerHandle handle = new CullerHandle();

        public OspCuller()
        {
            Osp.CheckVersion();
            IntPtr made;
            Osp.Check(Native.osp_culler_new(out made));
            handle.Take(made);
        }

        /// <summary>Frees the culler as soon as no call is running.</summary>
        public void Dispose()
        {
            handle.Dispose();
        }

        /// <summary>Number of objects with a valid box.</summary>
        public int Count
        {
            get
            {
                UIntPtr count;
                Osp.Check(Native.osp_culler_count(handle, out count));
                return (int)count;
            }
        }

        /// <summary>Inserts an object, or moves it. If the box is invalid, the object is skipped, and Refused lists it.</summary>
        public void Set(ulong key, OspBox box)
        {
            Osp.Check(Native.osp_culler_set(handle, &key, &box, (UIntPtr)1));
        }

        /// <summary>Inserts or moves many objects.</summary>
        public void Set(ReadOnlySpan<ulong> keys, ReadOnlySpan<OspBox> boxes)
        {
            Osp.Length(boxes.Length, keys.Length, "boxes");
            fixed (ulong* named = &MemoryMarshal.GetReference(keys))
            fixed (OspBox* places = &MemoryMarshal.GetReference(boxes))
            {
                Osp.Check(Native.osp_culler_set(handle, named, places, (UIntPtr)keys.Length));
            }
        }

        /// <summary>Removes an object, with its occluder and layers. A call for an unknown key has no effect.</summary>
        public void Remove(ulong key)
        {
            Osp.Check(Native.osp_culler_remove(handle, &key, (UIntPtr)1));
        }

        /// <summary>Removes many objects.</summary>
        public void Remove(ReadOnlySpan<ulong> keys)
        {
            fixed (ulong* named = &MemoryMarshal.GetReference(keys))
            {
                Osp.Check(Native.osp_culler_remove(handle, named, (UIntPtr)keys.Length));
            }
        }

        /// <summary>Removes everything.</summary>
        public void Clear()
        {
            Osp.Check(Native.osp_culler_clear(handle));
        }

        /// <summary>Sets the layers of an object, a mask with a bit for each layer. The default is 1.</summary>
        public void SetLayers(ulong key, uint layers)
        {
            Osp.Check(Native.osp_culler_set_layers(handle, &key, &layers, (UIntPtr)1));
        }

        /// <summary>Sets a flat, convex quad as an object's occluder: x y z of each corner. It stays until the object moves.</summary>
        public void SetOccluderQuad(ulong key, ReadOnlySpan<float> corners)
        {
            Osp.Length(corners.Length, 12, "corners");
            fixed (float* numbers = &MemoryMarshal.GetReference(corners))
            {
                Osp.Check(Native.osp_culler_set_occluder_quad(handle, key, numbers));
            }
        }

        /// <summary>Sets the six sides of a box as an object's occluder.</summary>
        public void SetOccluderBox(ulong key, OspBox box)
        {
            Osp.Check(Native.osp_culler_set_occluder_box(handle, key, &box));
        }

        /// <summary>Sets a mesh as an object's occluder: three numbers for each vertex, three indices for each triangle.</summary>
        public void SetOccluderMesh(ulong key, ReadOnlySpan<float> vertices, ReadOnlySpan<uint> indices)
        {
            Osp.Length(vertices.Length % 3, 0, "vertices, beyond three for each");
            Osp.Length(indices.Length % 3, 0, "indices, beyond three for each triangle");
            fixed (float* numbers = &MemoryMarshal.GetReference(vertices))
            fixed (uint* places = &MemoryMarshal.GetReference(indices))
            {
                Osp.Check(Native.osp_culler_set_occluder_mesh(handle, key, numbers, (UIntPtr)(vertices.Length / 3), places,
                    (UIntPtr)(indices.Length / 3)));
            }
        }

        /// <summary>Removes an object's occluder. Has no effect if the object has no occluder.</summary>
        public void RemoveOccluder(ulong key)
        {
            Osp.Check(Native.osp_culler_remove_occluder(handle, key));
        }

        /// <summary>Applies all changes, so that InBox, InSphere, OnRay and Nearest use them. Cull applies them, too.</summary>
        public void Commit()
        {
            Osp.Check(Native.osp_culler_commit(handle));
        }

        /// <summary>Returns the last valid box of an object.</summary>
        public OspBox Box(ulong key)
        {
            OspBox box;
            Osp.Check(Native.osp_culler_box(handle, key, out box));
            return box;
        }

        /// <summary>Finds the objects that a camera sees. Visible lists them.</summary>
        public OspSeen Cull(OspCamera camera)
        {
            OspSeen seen;
            Osp.Check(Native.osp_culler_cull(handle, &camera, (UIntPtr)1, &seen));
            return seen;
        }

        /// <summary>Finds the objects that each camera sees: two eyes, or a camera and its lights. seen is empty, or has an entry for
        /// each camera.</summary>
        public void Cull(ReadOnlySpan<OspCamera> cameras, Span<OspSeen> seen)
        {
            if (seen.Length > 0)
            {
                Osp.Length(seen.Length, cameras.Length, "seen");
            }
            fixed (OspCamera* eyes = &MemoryMarshal.GetReference(cameras))
            fixed (OspSeen* to = &MemoryMarshal.GetReference(seen))
            {
                OspSeen* places = seen.Length > 0 ? to : null;
                Osp.Check(Native.osp_culler_cull(handle, eyes, (UIntPtr)cameras.Length, places));
            }
        }

        /// <summary>Lists the keys of the objects that a camera of the last Cull sees, in no order. Returns false if there are more keys
        /// than room.</summary>
        public bool Visible(int camera, Span<ulong> keys, out int count)
        {
            fixed (ulong* to = &MemoryMarshal.GetReference(keys))
            {
                UIntPtr found;
                UIntPtr place = (UIntPtr)unchecked((uint)camera);
                OspStatus status = Native.osp_culler_visible(handle, place, to, (UIntPtr)keys.Length, out found);
                count = (int)found;
                return Osp.HadRoom(status);
            }
        }

        /// <summary>Does the same with an array that grows if necessary. Returns the number of keys.</summary>
        public int Visible(int camera, ref ulong[] keys)
        {
            int count;
            keys = keys ?? Array.Empty<ulong>();
            while (!Visible(camera, keys, out count))
            {
                Osp.Grow(ref keys, count);
            }
            return count;
        }

        /// <summary>Finds for each box whether it is completely hidden from a camera. The boxes need not belong to objects: they may
        /// surround sounds or characters.</summary>
        public void AreHidden(OspCamera camera, ReadOnlySpan<OspBox> boxes, Span<bool> hidden)
        {
            Osp.Length(hidden.Length, boxes.Length, "hidden");
            fixed (OspBox* places = &MemoryMarshal.GetReference(boxes))
            fixed (bool* to = &MemoryMarshal.GetReference(hidden))
            {
                Osp.Check(Native.osp_culler_are_hidden(handle, &camera, places, (UIntPtr)boxes.Length, (byte*)to));
            }
        }

        /// <summary>Lists the refusals between the last two calls of Cull, with the reasons. Only the first 4096 are listed.</summary>
        public OspRefused[] Refused()
        {
            OspRefused[] refused = Array.Empty<OspRefused>();
            while (true)
            {
                fixed (OspRefused* to = &MemoryMarshal.GetReference(refused.AsSpan()))
                {
                    UIntPtr found;
                    OspStatus status = Native.osp_culler_refused(handle, to, (UIntPtr)refused.Length, out found);
                    if (Osp.HadRoom(status))
                    {
                        Array.Resize(ref refused, (int)found);
                        return refused;
                    }
                    refused = new OspRefused[(int)found];
                }
            }
        }

        /// <summary>Finds the objects whose boxes have a point in common with a box. Returns false if there are more keys than
        /// room.</summary>
        public bool InBox(OspBox box, Span<ulong> keys, out int count)
        {
            fixed (ulong* to = &MemoryMarshal.GetReference(keys))
            {
                UIntPtr found;
                OspStatus status = Native.osp_culler_in_box(handle, &box, to, (UIntPtr)keys.Length, out found);
                count = (int)found;
                return Osp.HadRoom(status);
            }
        }

        /// <summary>Finds the objects whose boxes have a point in common with a sphere. Returns false if there are more keys than
        /// room.</summary>
        public bool InSphere(float x, float y, float z, float radius, Span<ulong> keys, out int count)
        {
            float* center = stackalloc float[3];
            center[0] = x;
            center[1] = y;
            center[2] = z;
            fixed (ulong* to = &MemoryMarshal.GetReference(keys))
            {
                UIntPtr found;
                OspStatus status = Native.osp_culler_in_sphere(handle, center, radius, to, (UIntPtr)keys.Length, out found);
                count = (int)found;
                return Osp.HadRoom(status);
            }
        }

        /// <summary>Finds the objects whose boxes a ray enters at t up to tMax, the nearest first, at most hits.Length of them. Returns
        /// the number of all entered boxes. origin and direction are x y z. To pick an object by its mesh, test the objects in this order
        /// until T is beyond the nearest hit.</summary>
        public int OnRay(ReadOnlySpan<float> origin, ReadOnlySpan<float> direction, float tMax, Span<OspHit> hits)
        {
            Osp.Length(origin.Length, 3, "origin");
            Osp.Length(direction.Length, 3, "direction");
            fixed (float* from = &MemoryMarshal.GetReference(origin))
            fixed (float* along = &MemoryMarshal.GetReference(direction))
            fixed (OspHit* to = &MemoryMarshal.GetReference(hits))
            {
                UIntPtr count;
                Osp.Check(Native.osp_culler_on_ray(handle, from, along, tMax, to, (UIntPtr)hits.Length, out count));
                return (int)count;
            }
        }

        /// <summary>Finds the objects whose boxes are nearest to a point, at most hits.Length of them, the nearest first. Returns their
        /// number. T is the distance.</summary>
        public int Nearest(float x, float y, float z, Span<OspHit> hits)
        {
            float* point = stackalloc float[3];
            point[0] = x;
            point[1] = y;
            point[2] = z;
            fixed (OspHit* to = &MemoryMarshal.GetReference(hits))
            {
                UIntPtr count;
                Osp.Check(Native.osp_culler_nearest(handle, point, to, (UIntPtr)hits.Length, out count));
                return (int)count;
            }
        }
    }

    sealed class CullerHandle : SafeHandleZeroOrMinusOneIsInvalid
    {
        internal CullerHandle() : base(true)
        {
        }

        internal void Take(IntPtr made)
        {
            SetHandle(made);
        }

        protected override bool ReleaseHandle()
        {
            return Native.osp_culler_free(handle) == OspStatus.Ok;
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
        internal static extern OspStatus osp_camera_f32(float* clipFromWorld, int depth, out OspCamera camera);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_camera_f64(double* clipFromWorld, int depth, out OspCamera camera);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_camera_ray(OspCamera* camera, float x, float y, float* origin, float* direction);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_culler_new(out IntPtr culler);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_culler_free(IntPtr culler);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_culler_set(CullerHandle culler, ulong* keys, OspBox* boxes, UIntPtr count);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_culler_remove(CullerHandle culler, ulong* keys, UIntPtr count);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_culler_clear(CullerHandle culler);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_culler_set_layers(CullerHandle culler, ulong* keys, uint* layers, UIntPtr count);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_culler_set_occluder_quad(CullerHandle culler, ulong key, float* corners);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_culler_set_occluder_box(CullerHandle culler, ulong key, OspBox* bounds);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_culler_set_occluder_mesh(CullerHandle culler, ulong key, float* vertices,
            UIntPtr vertexCount, uint* indices, UIntPtr triangleCount);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_culler_remove_occluder(CullerHandle culler, ulong key);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_culler_commit(CullerHandle culler);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_culler_count(CullerHandle culler, out UIntPtr count);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_culler_box(CullerHandle culler, ulong key, out OspBox bounds);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_culler_cull(CullerHandle culler, OspCamera* cameras, UIntPtr cameraCount, OspSeen* seen);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_culler_visible(
            CullerHandle culler, UIntPtr camera, ulong* keys, UIntPtr room, out UIntPtr count);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_culler_are_hidden(
            CullerHandle culler, OspCamera* camera, OspBox* boxes, UIntPtr count, byte* hidden);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_culler_refused(
            CullerHandle culler, OspRefused* refused, UIntPtr room, out UIntPtr count);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_culler_in_box(
            CullerHandle culler, OspBox* bounds, ulong* keys, UIntPtr room, out UIntPtr count);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_culler_in_sphere(
            CullerHandle culler, float* center, float radius, ulong* keys, UIntPtr room, out UIntPtr count);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_culler_on_ray(CullerHandle culler, float* origin, float* direction, float tMax,
            OspHit* hits, UIntPtr room, out UIntPtr count);

        [DllImport(Library, CallingConvention = C)]
        internal static extern OspStatus osp_culler_nearest(
            CullerHandle culler, float* point, OspHit* hits, UIntPtr room, out UIntPtr count);
    }
}
